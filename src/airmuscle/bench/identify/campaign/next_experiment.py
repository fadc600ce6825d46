"""Records of a campaign as a whole: check that they are of one rig, and the next experiments."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core import AirmuscleError, IdentificationError, ShortRepr
from ....physics.muscle.characteristic.validity_range import ValidityRange
from ....recording import Recording
from ..data_checks import level_text
from ..dynamic import rank_records
from ..dynamic.record_ranking import MIN_GAIN
from ..experiment_design import BenchLimits, ExperimentPlan, PlannedRun, optimal_design
from ..matched_rows import match_rows
from .creep_stage import CreepStage
from .fill_stage import FillStage
from .record import CampaignRecord, RecordKind
from .static_stage import StaticStage
from .transient import LeftOutStage

MAX_RATIO, MAX_SCALE = 1.5, 10.0
"""Maximum ratio of the forces of two records at the same pressure, contraction and length, and of the maximum forces by
pressure of two isobaric records of one length (chosen)."""
REMEDY = "Give the files of one muscle and one rig in a folder of their own"


def check_one_rig(records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where records of one length are of different specimens, or contradict each other."""
    by_length: dict[float, list[CampaignRecord]] = {}
    for record in records:
        if record.kind is not RecordKind.UNUSED and record.resting_length is not None:
            by_length.setdefault(round(record.resting_length, 6), []).append(record)
    for length, own in by_length.items():
        specimens = {str(r.recording.constants["specimen"]) for r in own if "specimen" in r.recording.constants}
        if len(specimens) > 1:
            names = ", ".join(sorted(specimens))
            raise IdentificationError(
                f"the records of {1e3 * length:.4g} mm are of several specimens: {names}. {REMEDY}."
            )
        isobaric = [record for record in own if record.kind is RecordKind.ISOBARIC]
        _check_scale(isobaric)
        _check_forces([record.recording for record in isobaric])


def _check_scale(records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where the force by pressure differs by a factor that only a unit explains."""
    levels = [(record.recording, record.level[1]) for record in records if record.level is not None]
    scales = [(float(np.max(each["force"])) / level, each) for each, level in levels if level > 0]
    positive = sorted((pair for pair in scales if pair[0] > 0), key=lambda pair: pair[0])
    if positive and positive[-1][0] > MAX_SCALE * positive[0][0]:
        (low, first), (high, last) = positive[0], positive[-1]
        raise IdentificationError(
            f"the force by pressure of {_with_units(last)} is {high / low:.3g} times that of {_with_units(first)}, at "
            f"the same length: a unit is wrong, or the files are of different muscles. {REMEDY}, or correct the units."
        )


def _with_units(recording: Recording) -> str:
    units = [f"{name} in {recording.units[name]}" for name in ("pressure", "force") if name in recording.units]
    return f"{recording.origin} ({', '.join(units)})"


def _check_forces(recordings: Sequence[Recording]) -> None:
    """Raise IdentificationError where forces at equal pressure and contraction differ by a factor."""
    for each in match_rows(recordings).runs:
        names = [block.recording.origin for block in (each.first, each.second)]
        first, second = (float(np.mean(force)) for force in each.forces)
        if max(first, second) > MAX_RATIO * min(first, second):
            pressure = float(np.median(each.first.recording["pressure"][each.first.rows]))
            raise IdentificationError(
                f"{' and '.join(names)} contradict each other: at {pressure / 1e3:.3g} kPa and the same contractions "
                f"their forces are {first:.4g} and {second:.4g} N. They are of different muscles or rigs, or a unit is "
                f"wrong. {REMEDY}, or correct the units."
            )


PLANNED_RUNS, PLANNED_POINTS = 4, 15
"""Number of planned static runs, and of their points (chosen)."""
POORLY_DETERMINED = 0.05
"""Relative standard error of a parameter of valve or wall from which a further record is planned (chosen)."""
MIN_LENGTHS = 3
"""Number of resting lengths from which the error for other lengths can be judged."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class NextExperiment(ShortRepr):
    """An experiment that would improve the muscle: what to measure, and why; `plan` has the runs of a static one."""

    measure: str
    purpose: str
    plan: ExperimentPlan | None = None


def plan_next(stages: Sequence[object], records: Sequence[CampaignRecord]) -> tuple[NextExperiment, ...]:
    """The next experiments: missing ones, then those that determine weak parameters, then static runs."""
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
                planned.append(NextExperiment(text, "creep: the longest relaxation time is extrapolated"))
    for stage in stages:
        if isinstance(stage, StaticStage):
            planned += [*_lengths(records), *_static_runs(stage)]
    return tuple(planned)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _separating_records(stage: FillStage) -> list[NextExperiment]:
    """The experiments that determine what the fills do not, and the record that would separate valve and wall."""
    planned = []
    for each in stage.fit.identifiability.undetermined:
        names = ", ".join(name for name, _ in each.shares)
        planned.append(NextExperiment(_sentence(each.remedy), f"fills: {names} are not determined"))
    try:
        ranking = rank_records(stage.fit)
    except AirmuscleError:
        return planned  # fewer than two common parameters within their bounds
    best, (first, second) = ranking.ranking[0], ranking.pair
    if ranking.now.worst < POORLY_DETERMINED or best.gain < MIN_GAIN:
        return planned
    now, after = (100.0 * each.worst for each in (ranking.now, best.precision))
    purpose = f"fills: {first} and {second} have a relative standard error of up to {now:.2g} %, then {after:.2g} %"
    return [*planned, NextExperiment(_sentence(f"measure {best.description}"), purpose)]


def _lengths(records: Sequence[CampaignRecord]) -> list[NextExperiment]:
    lengths = {r.resting_length for r in records if r.kind.is_static and r.resting_length is not None}
    measured = f"{len(lengths)} resting {'length is' if len(lengths) == 1 else 'lengths are'} measured"
    text = "Measure muscles of the same type with three resting lengths, each at three pressures or more."
    next_length = NextExperiment(text, f"lengths: {measured}, so the error for other lengths is not known")
    return [next_length] if len(lengths) < MIN_LENGTHS else []


def _levels(run: PlannedRun) -> str:
    """A planned run as a phrase: its constant quantity and the sweep of the other."""
    ends = " to ".join(level_text(run.swept, end) for end in run.sweep_limits)
    return f"{run.constant} {level_text(run.constant, run.level)}, {run.swept} {ends}"


def _static_runs(stage: StaticStage) -> list[NextExperiment]:
    fit, ranges = stage.fit, stage.fit.data_ranges
    (low, high), (least, greatest) = ranges["pressure"], ranges["contraction"]
    limits = BenchLimits(ValidityRange(max(low, 0.0), high, max(least, 0.0), greatest), ranges["force"][1])
    fixed = tuple(leaf.path for i, leaf in enumerate(fit.problem.leaves) if i not in set(fit.problem.free))
    sigma = max(fit.sigma, 1e-9)
    try:
        plan = optimal_design(fit.model, limits, runs=PLANNED_RUNS, points=PLANNED_POINTS, sigma=sigma, fixed=fixed)
    except AirmuscleError:
        return []  # the law has no derivative at a corner of the range; the other experiments remain
    text = f"Measure {len(plan.runs)} further static runs: {'; '.join(map(_levels, plan.runs))}."
    return [NextExperiment(text, "static characteristic: the D-optimal runs within the range of the records", plan)]
