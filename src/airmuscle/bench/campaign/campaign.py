"""Identification of one muscle from all records of a rig, stage by stage, and the next
experiments.
"""

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

from ...core import AirmuscleError, IdentificationError
from ...engine.distribution import stored_result
from ...engine.processes import Workers, process_pool
from ...physics import CreepElements, Geometry, NoFriction, ValidityRange
from ...recording import Recording
from ..diagnosis import DataUse, level_text, support_of
from ..dynamics import MIN_GAIN, rank_records
from ..statics import BenchLimits, PlannedRun, optimal_design
from .creep_stage import CreepStage, fit_creep_stage
from .fill_stage import FillStage, fit_fill_stage
from .friction_and_release import FrictionStage, fit_friction_stage, fit_release_stage
from .record import CampaignRecord, RecordKind, check_one_rig, classify_records
from .result import STAGES, Campaign, NextExperiment, main_length
from .static_stage import StaticStage, fit_static_stage
from .transient import LeftOutStage, named

T = TypeVar("T")
_WEIGHTS = (0.05, 0.05, 0.35, 0.3, 0.15, 0.08, 0.02)
"""Shares of the stages in the computing time (chosen)."""


def _check_used(recordings: Sequence[Recording], records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where no record can be used."""
    support = support_of(recordings)
    used = [record for record in records if record.kind is not RecordKind.UNUSED]
    if all(record.kind.is_static for record in used):
        support.check(DataUse.FIT)  # with the cause in the data
    if not used:
        reasons = "; ".join(f"{record.origin}: {record.reason}" for record in records)
        raise IdentificationError(
            f"no record of the campaign can be used ({reasons or 'there is no recording'}). Give"
            " records with pressure, length and force, and the resting length."
        )


def identify_campaign(
    recordings: Sequence[Recording],
    *,
    geometry: Geometry | None = None,
    progress: Callable[[str, float], None] | None = None,
    finished: Callable[[str, object], None] | None = None,
    workers: Workers = 1,
) -> Campaign:
    """Identify one muscle from all recordings of a rig.

    The records are sorted by kind. Creep is fitted to holds; friction to loops freed of creep; the
    static characteristic to the slow rows freed of both; valve and volume to fills and discharges;
    the damping to releases. A stage that the records do not allow is left out with its reason.

    geometry  the geometry of the muscle; by default the volume follows from the static law and
              fills at several lengths
    progress  called with the name of the stage and the completed fraction of the campaign
    finished  called with the name and the result of each stage as it ends
    workers   number of processes, as in `compare`: of the fits of loops and of the candidates of
              the static law

    Within `result_store` a finished stage is stored, and not fitted again by a later call with the
    same recordings and geometry.

    Raises IdentificationError where no record can be used, with the cause in the data if there is
    one (`support_of`).
    """
    records = classify_records(named(recordings))
    steps = _Steps(progress, finished, (records, geometry))
    _check_used(recordings, records)
    check_one_rig(records)
    steps.end("records", records)
    of_kind = {kind: [record for record in records if record.kind is kind] for kind in RecordKind}
    creep = steps.fit("creep", lambda _: fit_creep_stage(of_kind[RecordKind.CREEP]))
    elements = creep.elements if isinstance(creep, CreepStage) else CreepElements()
    with process_pool(workers, one_thread_each=True, terminate=True) as executor:
        hysteresis = steps.fit(
            "hysteresis", lambda show: fit_friction_stage(records, elements, show, executor)
        )
        friction = hysteresis.friction if isinstance(hysteresis, FrictionStage) else NoFriction()
        static = steps.fit(
            "static characteristic",
            lambda show: fit_static_stage(records, friction, elements, show, executor),
        )
    filled = of_kind[RecordKind.FILL]
    main = main_length(filled)
    if len({r.resting_length for r in filled} - {None}) > 1:  # one muscle, that of the most records
        filled = [r for r in filled if r.resting_length == main]
    change = None
    if isinstance(static, StaticStage) and main is not None:
        change = static.volume_change(main)
    fills = steps.fit(
        "fills and volume", lambda show: fit_fill_stage(filled, geometry, change, show)
    )
    partial = Campaign(
        records, creep, hysteresis, static, fills, LeftOutStage("release", "", ""), (), geometry
    )
    releases = of_kind[RecordKind.RELEASE]
    muscle = partial.muscle(releases[0].resting_length) if releases else None
    release = steps.fit("release", lambda _: fit_release_stage(releases, muscle))
    planned = steps.end("plan", plan_next((creep, hysteresis, static, fills, release), records))
    return dataclasses.replace(partial, release=release, next_experiments=planned)


@dataclasses.dataclass(frozen=True)
class _Steps:
    """Progress over the stages; `data` is what determines their results."""

    progress: Callable[[str, float], None] | None
    finished: Callable[[str, object], None] | None
    data: Any

    def show(self, stage: str, fraction: float) -> None:
        """Report the completed fraction of a stage."""
        number = STAGES.index(stage)
        if self.progress is not None:
            self.progress(
                stage, (sum(_WEIGHTS[:number]) + _WEIGHTS[number] * fraction) / sum(_WEIGHTS)
            )

    def fit(self, stage: str, task: Callable[[Callable[[float], None]], T]) -> T:
        """The result of a stage: the stored one, or that of the task, which is called with the
        progress.
        """
        name = f"{__name__}:{stage}"
        result = stored_result(name, self.data, lambda: task(partial(self.show, stage)))
        return self.end(stage, result)

    def end(self, stage: str, result: T) -> T:
        """Report the end of a stage with its result."""
        self.show(stage, 1.0)
        if self.finished is not None:
            self.finished(stage, result)
        return result


PLANNED_RUNS = 4
PLANNED_POINTS = 15
"""Number of planned static runs, and of their points (chosen)."""
POORLY_DETERMINED = 0.05
"""Relative standard error of a parameter of valve or wall from which a further record is planned
(chosen).
"""
MIN_LENGTHS = 3
"""Number of resting lengths from which the error for other lengths can be judged."""


def plan_next(
    stages: Sequence[object], records: Sequence[CampaignRecord]
) -> tuple[NextExperiment, ...]:
    """The next experiments: missing ones, then those that determine weak parameters, then static
    runs.
    """
    planned = [
        NextExperiment(_sentence(stage.remedy), f"{stage.name}: {stage.reason.rstrip('.')}")
        for stage in stages
        if isinstance(stage, LeftOutStage) and stage.remedy
    ]
    for stage in stages:
        if isinstance(stage, FillStage):
            planned += _separating_records(stage)
        elif isinstance(stage, CreepStage):
            longest = max(stage.elements.relaxation_times, default=0.0)
            if longest > stage.longest / 2:
                text = f"Hold the length for {6 * longest:.2g} s instead of {stage.longest:.3g} s."
                planned.append(
                    NextExperiment(text, "creep: the longest relaxation time is extrapolated")
                )
    lengths = {
        r.resting_length for r in records if r.kind.is_static and r.resting_length is not None
    }
    measured = (
        f"{len(lengths)} resting {'length is' if len(lengths) == 1 else 'lengths are'} measured"
    )
    text = (
        "Measure muscles of the same type with three resting lengths, each at three pressures or"
        " more."
    )
    further = NextExperiment(
        text, f"lengths: {measured}, so the error for other lengths is not known"
    )
    for stage in stages:
        if isinstance(stage, StaticStage):
            planned += [*([further] if len(lengths) < MIN_LENGTHS else []), *_static_runs(stage)]
    return tuple(planned)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _separating_records(stage: FillStage) -> list[NextExperiment]:
    """The experiments that determine what the fills do not, and the record that would separate
    valve and wall.
    """
    planned = []
    for combination in stage.fit.identifiability.undetermined:
        names = ", ".join(name for name, _ in combination.shares)
        planned.append(
            NextExperiment(_sentence(combination.remedy), f"fills: {names} are not determined")
        )
    try:
        ranking = rank_records(stage.fit)
    except AirmuscleError:
        return planned  # fewer than two common parameters within their bounds
    best = ranking.ranking[0]
    first, second = ranking.pair
    if ranking.now.worst < POORLY_DETERMINED or best.gain < MIN_GAIN:
        return planned
    now, after = (100.0 * precision.worst for precision in (ranking.now, best.precision))
    purpose = (
        f"fills: {first} and {second} have a relative standard error of up to {now:.2g} %, then"
        f" {after:.2g} %"
    )
    return [*planned, NextExperiment(_sentence(f"measure {best.description}"), purpose)]


def _levels(run: PlannedRun) -> str:
    """A planned run as a phrase: its constant quantity and the sweep of the other."""
    ends = " to ".join(level_text(run.swept, end) for end in run.sweep_limits)
    return f"{run.constant} {level_text(run.constant, run.level)}, {run.swept} {ends}"


def _static_runs(stage: StaticStage) -> list[NextExperiment]:
    fit = stage.fit
    ranges = stage.fit.data_ranges
    low, high = ranges["pressure"]
    least, greatest = ranges["contraction"]
    fixed = tuple(
        leaf.path for i, leaf in enumerate(fit.problem.leaves) if i not in set(fit.problem.free)
    )
    sigma = max(fit.sigma, 1e-9)
    try:
        limits = BenchLimits(
            ValidityRange(max(low, 0.0), high, max(least, 0.0), greatest), ranges["force"][1]
        )
        plan = optimal_design(
            fit.model, limits, runs=PLANNED_RUNS, points=PLANNED_POINTS, sigma=sigma, fixed=fixed
        )
    except AirmuscleError:
        # a range of one value, or no derivative of the law at a corner; the other experiments
        # remain
        return []
    text = f"Measure {len(plan.runs)} further static runs: {'; '.join(map(_levels, plan.runs))}."
    return [
        NextExperiment(
            text, "static characteristic: the D-optimal runs within the range of the records", plan
        )
    ]
