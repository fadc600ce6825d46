"""Stages of a campaign in a report: the records of each stage, and its result in one sentence."""

from __future__ import annotations

from . import Campaign, CreepStage, FillStage, FrictionStage, LeftOutStage, RecordKind, ReleaseStage, StaticStage

USES = {
    RecordKind.ISOBARIC: "static characteristic, hysteresis",
    RecordKind.ISOMETRIC: "static characteristic",
    RecordKind.ISOTONIC: "static characteristic",
    RecordKind.STATIC: "static characteristic",
    RecordKind.FILL: "valve, volume",
    RecordKind.RELEASE: "damping",
    RecordKind.CREEP: "creep",
    RecordKind.UNUSED: "nothing",
}
"""Stages for which the records of each kind are used."""
_KINDS = {
    "creep": (RecordKind.CREEP,),
    "hysteresis": (RecordKind.ISOBARIC,),
    "static characteristic": tuple(kind for kind in RecordKind if kind.is_static),
    "fills and volume": (RecordKind.FILL,),
    "release": (RecordKind.RELEASE,),
}


def count_records(campaign: Campaign, stage: str) -> int:
    """Return the number of records of the kinds that a stage uses."""
    return sum(record.kind in _KINDS[stage] for record in campaign.records)


def stage_result(
    stage: CreepStage | FrictionStage | StaticStage | FillStage | ReleaseStage | LeftOutStage,
) -> str:
    """Return the result of a stage in one sentence."""
    if isinstance(stage, FrictionStage):
        return _friction_result(stage)
    if isinstance(stage, StaticStage):
        best = stage.comparison.recommended
        return (
            f"{best.candidate.name[:1].upper()}{best.candidate.name[1:]} with {best.parameter_count} parameters, rms "
            f"error {best.cross_validated_rmse:.3g} N in cross-validation."
        )
    if isinstance(stage, FillStage):
        return _fill_result(stage)
    if isinstance(stage, ReleaseStage):
        damping = stage.fit["muscle.damper.damping"]
        return f"Damping {damping.value:.3g} N s/m (2 standard errors {damping.format_interval()})."
    return stage.verdict


def _friction_result(stage: FrictionStage) -> str:
    fit = stage.selected
    if fit is None:
        return "The loops justify no friction that holds for all of them." if stage.joint else stage.verdict
    amplitudes = [run.joint_amplitude for run in fit.agreement]
    return (
        f"{fit.name}, {min(amplitudes):.3g} to {max(amplitudes):.3g} N in {len(amplitudes)} loops; rms error "
        f"{fit.rmse_without_friction:.3g} N without and {fit.rmse:.3g} N with friction."
    )


def _fill_result(stage: FillStage) -> str:
    circuit, text = stage.circuit, ""
    if stage.cross_rms:
        worst = max(stage.cross_rms) / 1e3
        text = f"Each fill is predicted from the others within {worst:.3g} kPa (rms). "
    conductance = getattr(circuit.fill, "conductance", None)
    if conductance is not None:
        text += f"Conductance {conductance:.3g} m3/(s Pa), "
    volume = f"{text}volume at zero contraction {1e6 * float(stage.geometry.volume(0.0)):.3g} cm3."
    return f"{volume} {stage.misfit}".rstrip()
