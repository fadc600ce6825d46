"""Next experiments of a campaign: remedies of stages without a result, and the D-optimal static runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ....core.errors import AirmuscleError
from ....core.short_repr import ShortRepr
from ....physics.muscle.characteristic.validity_range import ValidityRange
from ..dynamic import rank_records
from ..dynamic.record_ranking import MIN_GAIN
from ..experiment_design import BenchLimits, ExperimentPlan, PlannedRun, optimal_design
from .creep_stage import CreepStage
from .fill_stage import FillStage
from .record import CampaignRecord
from .rows import LeftOutStage
from .static_stage import StaticStage

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


def plan_next(
    stages: Sequence[object], static: StaticStage | LeftOutStage, records: Sequence[CampaignRecord]
) -> tuple[NextExperiment, ...]:
    """The next experiments: missing ones, then those that determine weak parameters, then static runs."""
    missing = [
        NextExperiment(_sentence(stage.remedy), f"{stage.name}: {stage.reason.rstrip('.')}")
        for stage in stages
        if isinstance(stage, LeftOutStage) and stage.remedy
    ]
    return (*missing, *_undetermined(stages), *_lengths(static, records), *_static_runs(static))


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _undetermined(stages: Sequence[object]) -> list[NextExperiment]:
    """The experiments that separate parameters that the fills do not, and longer holds."""
    experiments = []
    for stage in stages:
        if isinstance(stage, FillStage):
            for each in stage.fit.identifiability.undetermined:
                names = ", ".join(name for name, _ in each.shares)
                experiments.append(NextExperiment(_sentence(each.remedy), f"fills: {names} are not determined"))
            experiments += _separating_record(stage)
        if isinstance(stage, CreepStage) and stage.elements.relaxation_times:
            longest = max(stage.elements.relaxation_times)
            if longest > stage.longest / 2:
                text = f"Hold the length for {6 * longest:.2g} s instead of {stage.longest:.3g} s."
                experiments.append(NextExperiment(text, "creep: the longest relaxation time is extrapolated"))
    return experiments


def _separating_record(stage: FillStage) -> list[NextExperiment]:
    """The record that would separate valve and wall, where the fills leave one of the two poorly determined."""
    try:
        ranking = rank_records(stage.fit)
    except AirmuscleError:
        return []  # fewer than two common parameters within their bounds
    best, (first, second) = ranking.ranking[0], ranking.pair
    if ranking.now.worst < POORLY_DETERMINED or best.gain < MIN_GAIN:
        return []
    now, after = (100.0 * each.worst for each in (ranking.now, best.precision))
    purpose = f"fills: {first} and {second} have a relative standard error of up to {now:.2g} %, then {after:.2g} %"
    return [NextExperiment(_sentence(f"measure {best.description}"), purpose)]


def _lengths(static: StaticStage | LeftOutStage, records: Sequence[CampaignRecord]) -> list[NextExperiment]:
    lengths = {r.resting_length for r in records if r.kind.is_static and r.resting_length is not None}
    if isinstance(static, LeftOutStage) or len(lengths) >= MIN_LENGTHS:
        return []
    return [
        NextExperiment(
            "Measure muscles of the same type with three resting lengths, each at three pressures or more.",
            f"lengths: {len(lengths)} resting {'length is' if len(lengths) == 1 else 'lengths are'} measured, so the "
            "error for other lengths is not known",
        )
    ]


def _levels(run: PlannedRun) -> str:
    """A planned run as a phrase: its constant quantity and the sweep of the other."""

    def text(name: str, value: float) -> str:
        value = 0.0 if abs(value) < 5e-5 else value
        return f"{value / 1e3:.3g} kPa" if name == "pressure" else f"{100 * value:.3g} %"

    ends = " to ".join(text(run.swept, end) for end in run.sweep_limits)
    return f"{run.constant} {text(run.constant, run.level)}, {run.swept} {ends}"


def _static_runs(static: StaticStage | LeftOutStage) -> list[NextExperiment]:
    if isinstance(static, LeftOutStage):
        return []
    fit = static.fit
    ranges = fit.data_ranges
    low = max(ranges["pressure"][0], 0.0)
    limits = BenchLimits(
        ValidityRange(low, ranges["pressure"][1], max(ranges["contraction"][0], 0.0), ranges["contraction"][1]),
        ranges["force"][1],
    )
    fixed = tuple(leaf.path for i, leaf in enumerate(fit.problem.leaves) if i not in set(fit.problem.free))
    try:
        plan = optimal_design(
            fit.model, limits, runs=PLANNED_RUNS, points=PLANNED_POINTS, sigma=max(fit.sigma, 1e-9), fixed=fixed
        )
    except AirmuscleError:
        return []  # the law has no derivative at a corner of the range; the other experiments remain
    return [
        NextExperiment(
            f"Measure {len(plan.runs)} further static runs: {'; '.join(map(_levels, plan.runs))}.",
            "static characteristic: the D-optimal runs within the range of the records",
            plan,
        )
    ]
