"""Result of a campaign: the records with their use, the result of each stage, the muscle, and the
overview of them.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, IdentificationError, ShortRepr, counted
from ...physics import CreepElements, ForceLaw, Friction, Geometry, LinearDamper, Muscle, NoFriction
from ...recording import Recording
from ...report.chapter import Chapter, Table, TableColumn
from ..comparison import law_of_length
from ..prediction import predicted_force
from ..reported import Reported
from ..statics import ExperimentPlan, run_table
from .creep_stage import CreepStage
from .fill_stage import FillStage
from .friction_and_release import FrictionStage, ReleaseStage
from .record import CampaignRecord, RecordKind
from .static_stage import StaticStage, force_limit
from .transient import LeftOutStage

STAGES = (
    "records",
    "creep",
    "hysteresis",
    "static characteristic",
    "fills and volume",
    "release",
    "plan",
)
"""The stages in their order; each is fitted with the results of those before it."""
StageResult = CreepStage | FrictionStage | StaticStage | FillStage | ReleaseStage | LeftOutStage
USES = {kind: "static characteristic" if kind.is_static else kind.value for kind in RecordKind} | {
    RecordKind.ISOBARIC: "static characteristic, hysteresis",
    RecordKind.FILL: "fills and volume",
    RecordKind.UNUSED: "nothing",
}
"""Stages for which the records of each kind are used."""


MAX_NEXT = 4
"""Rows of unused records and of further experiments in the brief view (chosen)."""


@dataclasses.dataclass(frozen=True)
class ValidationRow:
    """A record that was kept aside, its error [N] and the share of its rows within the 95 %
    band.
    """

    record: str
    rmse: float
    half_width: float
    share: float
    rows: int


class Prediction(NamedTuple):
    """Predicted force and the limits of its 95 % band at the rows of a record [N]; shape (N,)
    each.
    """

    force: Array
    low: Array
    high: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class NextExperiment(ShortRepr):
    """An experiment that would improve the muscle: what to measure, and why; `plan` has the runs of
    a static one.
    """

    measure: str
    purpose: str
    plan: ExperimentPlan | None = None


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Campaign(Reported):
    """The records of a rig with their use, the result of each stage, and the next experiments."""

    records: tuple[CampaignRecord, ...]
    creep: CreepStage | LeftOutStage
    hysteresis: FrictionStage | LeftOutStage
    static: StaticStage | LeftOutStage
    fills: FillStage | LeftOutStage
    release: ReleaseStage | LeftOutStage
    next_experiments: tuple[NextExperiment, ...]
    given_geometry: Geometry | None = None
    """The geometry that was given; it is that of the muscle also without fills."""

    @property
    def stages(self) -> tuple[tuple[str, StageResult], ...]:
        """The name and the result of each stage."""
        results = (self.creep, self.hysteresis, self.static, self.fills, self.release)
        return tuple(zip(STAGES[1:-1], results, strict=True))

    @property
    def friction(self) -> Friction:
        """The friction of the muscle."""
        return (
            self.hysteresis.friction if isinstance(self.hysteresis, FrictionStage) else NoFriction()
        )

    @property
    def creep_elements(self) -> CreepElements:
        """The creep elements of the muscle."""
        return self.creep.elements if isinstance(self.creep, CreepStage) else CreepElements()

    @property
    def resting_length(self) -> float | None:
        """Resting length of the muscle that is written [m]: that of the fills, else the longest of
        the static runs.
        """
        return main_length(self.records)

    def law(self, resting_length: float | None = None) -> ForceLaw | None:
        """The static law of a muscle of a resting length [m], by default the one that is
        written.
        """
        if not isinstance(self.static, StaticStage):
            return None
        law = law_of_length(self.static.fit.model, resting_length or self.resting_length)
        return law if isinstance(law, ForceLaw) else None

    def geometry(self, resting_length: float | None = None) -> Geometry | None:
        """The given geometry or that of the fills, for a resting length [m] with a volume in
        proportion; None without one."""
        measured = self.fills.geometry if isinstance(self.fills, FillStage) else self.given_geometry
        if measured is None:
            return None
        length = resting_length or self.resting_length
        if length is None or abs(length - measured.resting_length) < 1e-6:
            return measured
        change = self.static.volume_change(length) if isinstance(self.static, StaticStage) else None
        at_rest = float(measured.volume(0.0)) * length / measured.resting_length
        return None if change is None else change.geometry(at_rest)

    def muscle(self, resting_length: float | None = None) -> Muscle | None:
        """The muscle of a resting length [m] with all identified parts; None without a static law
        or a volume.
        """
        law = self.law(resting_length)
        geometry = self.geometry(resting_length)
        if law is None or geometry is None:
            return None
        assert isinstance(self.static, StaticStage)
        damper = (
            self.release.damper if isinstance(self.release, ReleaseStage) else LinearDamper(0.0)
        )
        return Muscle(
            law,
            geometry,
            damper=damper,
            friction=self.friction,
            creep=self.creep_elements,
            validity_range=self.static.fit.validity_range,
        )

    def predict(self, recording: Recording) -> Prediction:
        """The force along the pressure and the motion of a recording, with its 95 % band. The band
        is that of further runs for a resting length of the records, and that of other lengths
        otherwise. Raises IdentificationError without a static law, ColumnError without pressure and
        contraction."""
        if not isinstance(self.static, StaticStage):
            raise IdentificationError(
                f"the campaign has no static characteristic: {self.static.reason}."
            )
        length = recording.constants.get("resting_length")
        law = law_of_length(self.static.fit.model, None if length is None else float(length))
        force = predicted_force(
            law, recording, self.friction, self.creep_elements, force_limit(self.static.points)
        )
        known = {r.resting_length for r in self.records if r.kind.is_static}
        measured = length is None or any(abs(float(length) - k) < 1e-6 for k in known if k)
        half = self.static.half_width(recording, measured)
        return Prediction(np.maximum(force, 0.0), force - half, force + half)

    def chapter(
        self,
        unread: Sequence[tuple[str, str]] = (),
        scenarios: Sequence[tuple[str, str]] = (),
        validation: Sequence[ValidationRow] = (),
    ) -> Chapter:
        """The overview: stages, bands and records. `unread` are pairs of a file that could not be
        read and the reason, `scenarios` of a record and its scenario file or the reason."""
        stages = self.stages
        records = self.records
        used = sum(record.kind is not RecordKind.UNUSED for record in records)
        left_out = [(name, stage) for name, stage in stages if isinstance(stage, LeftOutStage)]
        sentences = [f"{used} of {len(records)} records are used."]
        sentences += [f"{counted(len(unread), 'file')} could not be read."] if unread else []
        names = ", ".join(name for name, _ in left_out)
        sentences.append(f"Not identified: {names}." if left_out else "All stages are identified.")
        notes = self.static.data_notes if isinstance(self.static, StaticStage) else ()
        columns: dict[str, Any] = {
            "stage": [name for name, _ in stages],
            "records": [sum(name in USES[record.kind] for record in records) for name, _ in stages],
            "identified": TableColumn(
                [not isinstance(stage, LeftOutStage) for _, stage in stages], brief=False
            ),
            "result": [stage_result(stage) for _, stage in stages],
        }
        files = {"file": [name for name, _ in unread], "reason": [reason for _, reason in unread]}
        tables: tuple[Table, ...] = (
            Table("campaign-stages", "Stages", columns, brief=len(stages), key="stages"),
            _band_table(self),
            _validation_table(validation),
            _record_table(self, dict(scenarios)),
            Table(
                "campaign-unread",
                "Files that could not be read",
                files,
                brief=MAX_NEXT,
                key="unread",
            ),
            *_next_tables(self.next_experiments),
        )
        tables = tuple(filter(len, tables))
        summary = " ".join([*_misfit(self.static), *sentences])
        return Chapter("campaign", "Overview", summary, tables=tables, notes=notes)


def _misfit(stage: StaticStage | LeftOutStage) -> list[str]:
    """The misfit of the static law, as sentences; empty without one."""
    misfit = stage.fit.misfit if isinstance(stage, StaticStage) else None
    return [] if misfit is None else [str(misfit)]


def main_length(records: Sequence[CampaignRecord]) -> float | None:
    for kinds in ((RecordKind.FILL,), (RecordKind.RELEASE,), tuple(RecordKind)):
        lengths = [
            r.resting_length for r in records if r.kind in kinds and r.resting_length is not None
        ]
        if lengths:
            return max(lengths, key=lambda length: (lengths.count(length), length))
    return None


def stage_result(stage: StageResult) -> str:
    """Return the result of a stage in one sentence."""
    if isinstance(stage, FrictionStage) and stage.selected is not None:
        fit = stage.selected
        amplitudes = [run.joint_amplitude for run in stage.selected.agreement]
        return (
            f"{fit.name}, {min(amplitudes):.3g} to {max(amplitudes):.3g} N in {len(amplitudes)}"
            f" loops; rms error {fit.rmse_without_friction:.3g} N without and {fit.rmse:.3g} N with"
            " friction."
        )
    if isinstance(stage, FrictionStage) and stage.joint:
        return "The loops justify no friction that holds for all of them."
    if isinstance(stage, StaticStage):
        best = stage.comparison.recommended
        return (
            f"{best.candidate.name[:1].upper()}{best.candidate.name[1:]} with"
            f" {best.parameter_count} parameters, rms error {best.cross_validated_rmse:.3g} N in"
            " cross-validation."
        )
    if isinstance(stage, FillStage):
        cross = stage.cross_rms
        conductance = getattr(stage.circuit.fill, "conductance", None)
        text = (
            f"Each fill is predicted from the others within {max(cross) / 1e3:.3g} kPa (rms). "
            if cross
            else ""
        )
        text += f"Conductance {conductance:.3g} m3/(s Pa), " if conductance is not None else ""
        volume = (
            f"{text}volume at zero contraction {1e6 * float(stage.geometry.volume(0.0)):.3g} cm3."
        )
        return f"{volume} {stage.misfit}".rstrip()
    if isinstance(stage, ReleaseStage):
        damping = stage.fit["muscle.damper.damping"]
        return f"Damping {damping.value:.3g} N s/m (2 standard errors {damping.format_interval()})."
    return stage.verdict


def _next_tables(experiments: Sequence[NextExperiment]) -> Iterator[Table]:
    """The table of the next experiments, and that of the first plan of static runs."""
    columns = {
        "measure": [experiment.measure for experiment in experiments],
        "because of": TableColumn([experiment.purpose for experiment in experiments], brief=False),
    }
    text = (
        "Missing stages first, then parameters that the records do not determine, then further"
        " static runs."
    )
    yield Table(
        "campaign-next", "What to measure next", columns, text, brief=MAX_NEXT, key="experiments"
    )
    plan = next(
        (experiment.plan for experiment in experiments if experiment.plan is not None), None
    )
    if plan is not None:
        runs = run_table(plan.runs, "campaign-plan", "D-optimal static runs to measure next")
        yield dataclasses.replace(runs, brief=0)


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
    return Table(
        "campaign-bands", "Error of the predicted force", columns, brief=len(bands), key="bands"
    )


def _validation_table(rows: Sequence[ValidationRow]) -> Table:
    columns: dict[str, Any] = {
        "record": [row.record for row in rows],
        "rms error": TableColumn([row.rmse for row in rows], "N"),
        "half width of the 95 % band": _half_widths(rows),
        "rows within the band": TableColumn(
            [row.share for row in rows], "1", "%", digits=3, short="within"
        ),
        "rows": [row.rows for row in rows],
    }
    return Table(
        "campaign-validation",
        "Records that were kept aside",
        columns,
        brief=len(rows),
        key="validation",
    )


def _record_table(campaign: Campaign, scenarios: dict[str, str]) -> Table:
    records = campaign.records
    columns: dict[str, Any] = {
        "record": [record.origin for record in records],
        "kind": [record.kind.value for record in records],
        "resting length": TableColumn(
            [record.resting_length for record in records], "m", "mm", brief=False
        ),
        "rows": TableColumn([len(record.recording) for record in records], brief=False),
        "reason": [record.reason for record in records],
        "used for": TableColumn([USES[record.kind] for record in records], brief=False),
        "scenario": TableColumn(
            [scenarios.get(record.origin, "") for record in records], brief=False
        ),
    }
    unused = [i for i, record in enumerate(records) if record.kind is RecordKind.UNUSED]
    return Table(
        "campaign-records", "Records and their use", columns, brief=unused[:MAX_NEXT], key="records"
    )
