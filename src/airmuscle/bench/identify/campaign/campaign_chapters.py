"""Report chapters of a campaign: an overview of records, stages and next experiments, then one part for each stage."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from ....core import Array, counted
from ....physics import CreepElements
from ....report import Chapter, Table, TableColumn, as_data
from ..compare_chapter import compare_chapter
from ..dynamic.dynamic_chapter import dynamic_chapters
from ..experiment_design import run_table
from ..hysteresis import loops_not_joined
from ..hysteresis.hysteresis_chapter import hysteresis_chapters, joint_friction_chapter
from ..static_fit_chapter import MuscleDescription, fit_chapter
from . import Campaign, CreepStage, FillStage, FrictionStage, LeftOutStage, RecordKind, ReleaseStage, StaticStage
from .campaign_plots import characteristic_plot, creep_plot, fill_plot, prediction_plot, residual_plot

USES = {kind: "static characteristic" if kind.is_static else kind.value for kind in RecordKind} | {
    RecordKind.ISOBARIC: "static characteristic, hysteresis",
    RecordKind.FILL: "fills and volume",
    RecordKind.UNUSED: "nothing",
}
"""Stages for which the records of each kind are used."""


def stage_result(stage: CreepStage | FrictionStage | StaticStage | FillStage | ReleaseStage | LeftOutStage) -> str:
    """Return the result of a stage in one sentence."""
    if isinstance(stage, FrictionStage) and stage.selected is not None:
        fit, amplitudes = stage.selected, [run.joint_amplitude for run in stage.selected.agreement]
        return (
            f"{fit.name}, {min(amplitudes):.3g} to {max(amplitudes):.3g} N in {len(amplitudes)} loops; rms error "
            f"{fit.rmse_without_friction:.3g} N without and {fit.rmse:.3g} N with friction."
        )
    if isinstance(stage, FrictionStage) and stage.joint:
        return "The loops justify no friction that holds for all of them."
    if isinstance(stage, StaticStage):
        best = stage.comparison.recommended
        return (
            f"{best.candidate.name[:1].upper()}{best.candidate.name[1:]} with {best.parameter_count} parameters, rms "
            f"error {best.cross_validated_rmse:.3g} N in cross-validation."
        )
    if isinstance(stage, FillStage):
        cross, conductance = stage.cross_rms, getattr(stage.circuit.fill, "conductance", None)
        text = f"Each fill is predicted from the others within {max(cross) / 1e3:.3g} kPa (rms). " if cross else ""
        text += f"Conductance {conductance:.3g} m3/(s Pa), " if conductance is not None else ""
        volume = f"{text}volume at zero contraction {1e6 * float(stage.geometry.volume(0.0)):.3g} cm3."
        return f"{volume} {stage.misfit}".rstrip()
    if isinstance(stage, ReleaseStage):
        damping = stage.fit["muscle.damper.damping"]
        return f"Damping {damping.value:.3g} N s/m (2 standard errors {damping.format_interval()})."
    return stage.verdict


MAX_NEXT = 4
"""Rows of unused records and of further experiments in the brief view (chosen)."""


@dataclasses.dataclass(frozen=True)
class ValidationRow:
    """A record that was kept aside, its error [N] and the share of its rows within the 95 % band."""

    record: str
    rmse: float
    half_width: float
    share: float
    rows: int


def campaign_chapters(
    campaign: Campaign, entry: MuscleDescription | None, *, unread: Sequence[tuple[str, str]] = (),
    scenarios: Sequence[tuple[str, str]] = (), validation: Sequence[ValidationRow] = (),
) -> list[Chapter]:  # fmt: skip
    """Return the chapters of a campaign. `unread` are pairs of a file that could not be read and the reason,
    `scenarios` of a record and its scenario file or the reason."""
    plots = (plot(campaign) for plot in (characteristic_plot, prediction_plot, residual_plot, fill_plot))
    summary = "The predicted force is that of the static law minus friction and creep along the recorded motion."
    muscle = Chapter("campaign-muscle", "Muscle and prediction error", summary, plots=tuple(filter(None, plots)))
    stages = sorted((stage for _, stage in campaign.stages), key=lambda stage: not isinstance(stage, StaticStage))
    chapters = [muscle, *(chapter for stage in stages for chapter in stage_chapters(stage, entry))]
    parts = [dataclasses.replace(chapter, brief=False) for chapter in chapters]
    return [_overview(campaign, unread, dict(scenarios), validation), _next(campaign), *parts]


def stage_chapters(stage: object, entry: MuscleDescription | None = None) -> list[Chapter]:
    """Return the chapters of one stage; that of the static law has the chapter of the muscle if its entry is given."""
    if isinstance(stage, StaticStage):
        fitted = stage.fit.chapter() if entry is None else fit_chapter(stage.fit, entry)
        return [compare_chapter(stage.comparison), fitted]
    if isinstance(stage, FrictionStage):
        loops, joint = stage.loops, stage.joint
        return [joint_friction_chapter(joint, loops_not_joined(loops))] if joint else hysteresis_chapters(loops)
    if isinstance(stage, CreepStage):
        holds = [f"{origin}: {fit.verdict}" for origin, fit in stage.holds]
        chapter = creep_chapter(stage.verdict, holds, stage.elements, stage.standard_errors)
        return [dataclasses.replace(chapter, plots=(creep_plot(stage),))]
    if isinstance(stage, FillStage | ReleaseStage):
        name, title = ("fill-", "Fills and volume") if isinstance(stage, FillStage) else ("release-", "Release")
        return [each.among(name) for each in dynamic_chapters(stage.fit, title)]
    return []


def stage_data(name: str, stage: object) -> dict[str, Any]:
    """Return a stage as plain data: name, verdict, whether it is identified, its chapters or the reason."""
    data: dict[str, Any] = {"stage": name, "verdict": getattr(stage, "verdict", "")}
    if isinstance(stage, LeftOutStage):
        return data | {"identified": False, "reason": stage.reason, "remedy": stage.remedy}
    if isinstance(stage, tuple):
        return data | {"count": len(stage)}
    return data | {"identified": True, **as_data(stage_chapters(stage))}


def _overview(
    campaign: Campaign, unread: Sequence[tuple[str, str]], scenarios: dict[str, str],
    validation: Sequence[ValidationRow],
) -> Chapter:  # fmt: skip
    """Return the chapter of the stages, the bands and the records."""
    stages, records = campaign.stages, campaign.records
    used = sum(record.kind is not RecordKind.UNUSED for record in records)
    left_out = [(name, stage) for name, stage in stages if isinstance(stage, LeftOutStage)]
    sentences = [f"{used} of {len(records)} records are used."]
    sentences += [f"{counted(len(unread), 'file')} could not be read."] if unread else []
    names = ", ".join(name for name, _ in left_out)
    sentences.append(f"Not identified: {names}." if left_out else "All stages are identified.")
    notes = list(campaign.static.data_notes) if isinstance(campaign.static, StaticStage) else []
    notes += [f"{name}: {stage.reason}; {stage.remedy}" for name, stage in left_out]
    columns: dict[str, Any] = {
        "stage": [name for name, _ in stages],
        "records": [sum(name in USES[record.kind] for record in records) for name, _ in stages],
        "identified": TableColumn([not isinstance(stage, LeftOutStage) for _, stage in stages], brief=False),
        "result": [stage_result(stage) for _, stage in stages],
    }
    files = {"file": [name for name, _ in unread], "reason": [reason for _, reason in unread]}
    tables = (
        Table("campaign-stages", "Stages", columns, brief=len(stages), key="stages"), _band_table(campaign),
        _validation_table(validation), _record_table(campaign, scenarios),
        Table("campaign-unread", "Files that could not be read", files, brief=MAX_NEXT, key="unread"),
    )  # fmt: skip
    return Chapter("campaign", "Overview", " ".join(sentences), tables=tuple(filter(len, tables)), notes=tuple(notes))


def _next(campaign: Campaign) -> Chapter:
    """Return the chapter of the next experiments."""
    experiments = campaign.next_experiments
    columns = {
        "measure": [each.measure for each in experiments],
        "because of": TableColumn([each.purpose for each in experiments], brief=False),
    }
    tables = [Table("campaign-next", "Experiments", columns, brief=MAX_NEXT, key="experiments")] if experiments else []
    title = "D-optimal static runs to measure next"
    plans = [each.plan for each in experiments if each.plan is not None]
    tables += [dataclasses.replace(run_table(plan.runs, "campaign-plan", title), brief=0) for plan in plans[:1]]
    summary = "Missing stages first, then parameters that the records do not determine, then further static runs."
    return Chapter("campaign-next", "What to measure next", summary, tables=tuple(tables))


def _half_widths(rows: Sequence[Any]) -> TableColumn:
    return TableColumn([row.half_width for row in rows], "N", digits=3, short="95 % band ±")


def _band_table(campaign: Campaign) -> Table:
    bands = campaign.static.all_bands if isinstance(campaign.static, StaticStage) else ()
    columns: dict[str, Any] = {
        "prediction of": [band.purpose for band in bands],
        "half width of the 95 % band": _half_widths(bands),
        "rms error": TableColumn([band.rmse for band in bands], "N", digits=3),
        "groups left out": TableColumn([band.groups for band in bands], brief=False),
        "rows": TableColumn([band.rows for band in bands], brief=False),
    }
    return Table("campaign-bands", "Error of the predicted force", columns, brief=len(bands), key="bands")


def _validation_table(rows: Sequence[ValidationRow]) -> Table:
    columns: dict[str, Any] = {
        "record": [row.record for row in rows],
        "rms error": TableColumn([row.rmse for row in rows], "N"),
        "half width of the 95 % band": _half_widths(rows),
        "rows within the band": TableColumn([row.share for row in rows], "1", "%", digits=3, short="within"),
        "rows": [row.rows for row in rows],
    }
    return Table("campaign-validation", "Records that were kept aside", columns, brief=len(rows), key="validation")


def _record_table(campaign: Campaign, scenarios: dict[str, str]) -> Table:
    records = campaign.records
    columns: dict[str, Any] = {
        "record": [record.origin for record in records],
        "kind": [record.kind.value for record in records],
        "resting length": TableColumn([record.resting_length for record in records], "m", "mm", brief=False),
        "rows": TableColumn([len(record.recording) for record in records], brief=False),
        "reason": [record.reason for record in records],
        "used for": TableColumn([USES[record.kind] for record in records], brief=False),
        "scenario": TableColumn([scenarios.get(record.origin, "") for record in records], brief=False),
    }
    unused = [i for i, record in enumerate(records) if record.kind is RecordKind.UNUSED]
    return Table("campaign-records", "Records and their use", columns, brief=unused[:MAX_NEXT], key="records")


def creep_chapter(verdict: str, sentences: Sequence[str], elements: CreepElements, standard_errors: Array) -> Chapter:
    """Return the chapter of creep: the verdict, a sentence on each hold, and the Maxwell elements with the standard
    errors of their stiffnesses [N/m], then of their relaxation times [s]."""
    count = len(elements.stiffnesses)
    columns: dict[str, Any] = {
        "stiffness": TableColumn(elements.stiffnesses, "N/m"),
        "standard error of the stiffness": TableColumn(standard_errors[:count], "N/m"),
        "relaxation time": TableColumn(elements.relaxation_times, "s"),
        "standard error of the time": TableColumn(standard_errors[count:], "s"),
    }
    table = Table("creep-elements", "Maxwell elements", columns, brief=count)
    return Chapter("creep", "Creep", (verdict, *sentences), tables=(table,) if count else ())
