"""Notes of a static fit: rows, weights, bounds, losses and misfit that affect its interpretation, as sentences."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core import Array, Hint, HintedText
from ...recording.columns import displayed
from ..segment.runs import RIPPLE_BAND
from .branch_residuals import branch_distance, branch_notes
from .data_checks import HELD, Remarks
from .fit_points import FitPoints
from .problem import FORCE, RESTING_LENGTH, FitProblem, LeastSquaresSolution
from .result import Fit
from .specimen_effects import SpecimenEffects
from .statistics import FitStatistics
from .weighting import UNCENSORED, Censoring, LeastSquares, Loss, default_censoring

NO_EFFECT = 0.05
"""Effective number of parameters of the specimen effects below which the specimens do not differ (chosen)."""
ILL_CONDITIONED = 1e5
"""Condition number of the scaled design matrix above which a note is added (chosen): half of the digits are lost."""


def examine(points: FitPoints, problem: FitProblem, modelled: Array, own: Sequence[str], fit: Fit) -> Remarks:
    """The remarks on a fit and its points; `own` are notes on the fit that need no examination of the data.

    The branches that the residuals follow are those of `problem` with the quantity `modelled` at its rows; of a pooled
    law they are those of its population.
    """
    checks, quantity = points.checks, problem.fitted_quantity
    residuals = np.full(len(points.joined), np.nan)
    differences = modelled - problem.data[quantity.name]
    residuals[~points.missing] = np.where(problem.censoring == 0, differences, np.nan)
    ends = np.cumsum([len(run) for run in points.recordings])
    distance = branch_distance(points.recordings, np.split(residuals, ends[:-1]), quantity.name)
    scatter = dataclasses.replace(checks.scatter, branches=distance)
    branches = branch_notes(points.recordings, distance, quantity.name, delayed=checks.delay is not None)
    notes = (*checks.notes, *map(str, points.repeated), *own, *branches, *_level_notes(fit.data_ranges))
    if fit.effects is not None:
        notes += (_effect_note(fit.effects),)
    if quantity == FORCE:
        lengths = {run.constants.get(RESTING_LENGTH) for run in points.recordings} - {None}
        count = 1 if hasattr(fit.model, "with_resting_length") else len(lengths)
        notes += tuple(scatter.misfit_notes(fit.rmse, fit.data_ranges["force"][1], count))
    return dataclasses.replace(checks, notes=notes, scatter=scatter)


def level_text(name: str, value: float) -> str:
    """The level [SI] of a quantity as text in its unit of display; a contraction near 0 is 0."""
    return displayed(name, 0.0 if name == "contraction" and abs(value) < 5e-5 else value, 3)


def _level_notes(ranges: Mapping[str, tuple[float, float]]) -> list[str]:
    """The remark that the pressure or the contraction was measured at one level only."""
    bands = {"pressure": RIPPLE_BAND * ranges["pressure"][1], "contraction": HELD}
    return [
        f"The {name} was measured at one level, {level_text(name, sum(ranges[name]) / 2)}: how the force depends on it "
        "follows from the form of the law, not from the data. Measure other levels before the law is used there."
        for name, band in bands.items()
        if np.ptp(ranges[name]) < band
    ]


def _effect_note(effects: SpecimenEffects) -> str:
    """The remark on the number of parameters of the specimen effects."""
    text = f"Partial pooling of {len(effects.specimens)} specimens: "
    if effects.degrees_of_freedom < NO_EFFECT:
        return f"{text}the data show no difference between them."
    return (
        f"{text}coefficients of the specimen effects with a standard deviation of {effects.deviation:.3g} N "
        f"(restricted maximum likelihood) and {effects.degrees_of_freedom:.3g} effective parameters of "
        f"{effects.coefficients.size}. The standard errors of the population parameters contain this scatter."
    )


def _row_notes(problem: FitProblem, statistics: FitStatistics, dropped: int) -> Iterator[str]:
    """Remarks on rows that are dropped, censored, above the limit of the law, or at zero force and not censored."""
    force, usual = problem.data["force"], default_censoring(problem.law)
    if dropped:
        yield f"{dropped} rows with a missing value (NaN) were dropped."
    if censored := int(np.count_nonzero(problem.censoring)):
        yield HintedText(
            f"{censored} {'row is' if censored == 1 else 'rows are'} censored (at zero force, or at the limit of "
            "the force range): counted only where the law violates the bound.",
            Hint("To treat them as measured values", "censoring", UNCENSORED, constant="UNCENSORED"),
        )
    if above := int(np.count_nonzero((force > usual.max_force) & (problem.censoring == -1))):
        yield (
            f"{above} rows are above the upper limit of the force of the law, max_force {usual.max_force:.4g} N, which "
            "the fit does not change: the law gives no greater force. Give a law with a greater max_force."
        )
    if statistics.uncensored_rank < statistics.rank:
        yield (
            f"The uncensored rows determine {statistics.uncensored_rank} of {statistics.rank} parameters; the others "
            "are limited only by the bounds of the censored rows, and the law is as close to these as possible."
        )
    if at_zero := int(np.count_nonzero((force <= 0) & (problem.censoring == 0))):
        slack = Hint("To treat them as censored, if the muscle was slack there", "censoring", Censoring())
        text = f"{at_zero} rows at zero force or below are treated as measured values."
        yield HintedText(text, *([slack] if usual != UNCENSORED else []))


def collect_notes(
    problem: FitProblem, solution: LeastSquaresSolution, statistics: FitStatistics, loss: Loss, dropped: int,
    by_recording: Array | None,
) -> Iterator[str]:  # fmt: skip
    """Remarks on the data and the fit that affect its interpretation, as sentences.

    `dropped` is the number of rows with a missing value, `by_recording` the standard deviations of sensors that differ.
    """
    yield from _row_notes(problem, statistics, dropped)
    length = problem.data.constants.get(RESTING_LENGTH)  # to which the contraction is relative
    for leaf in problem.leaves:
        if leaf.declared.name == RESTING_LENGTH and length is not None and abs(leaf.value - float(length)) > 1e-6:
            yield (
                f"The muscle in the recording has a resting length of {length:.4g} m, but {leaf.path} is "
                f"{leaf.value:.4g} m."
            )
    for i in np.flatnonzero(statistics.on_bound):
        yield f"{problem.leaves[problem.free[i]].path} is on its bound; its value is not determined by the data."
    if not np.isfinite(statistics.sigma):
        yield "There are as many rows as parameters, so the standard errors are unknown."
    if statistics.condition > ILL_CONDITIONED:
        yield f"The problem is ill-conditioned (condition number {statistics.condition:.2g})."
    unit = "" if problem.fitted_quantity.unit == "1" else f" {problem.fitted_quantity.unit}"
    if not isinstance(loss, LeastSquares):
        yield f"Robust loss: {loss}{unit and f', in{unit}'}."
    if by_recording is not None:
        yield HintedText(
            "The recordings come from test rigs with different sensors: rows are weighted by standard deviations of "
            f"{min(by_recording):.3g} to {max(by_recording):.3g}{unit}.",
            Hint("To weight all rows equally", "sigma", 1.0),
        )
    if not isinstance(loss, LeastSquares):
        residuals = np.abs(problem.residuals(solution.modelled))[problem.censoring == 0]
        inside = int(np.count_nonzero(residuals <= loss.scale))
        if inside < residuals.size / 2:
            yield (
                f"Only {inside} of {residuals.size} residuals are within the scale of {loss}, so the standard errors "
                "are too small. Use a scale of about three times the standard deviation of the noise."
            )
