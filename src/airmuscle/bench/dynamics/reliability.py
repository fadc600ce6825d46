"""Reliability of a dynamic fit beyond its standard errors: other optima, the effect of bounds,
scatter of records.

Standard errors describe the curvature at one optimum. They contain neither another optimum that
fits almost as well nor the effect of an unknown on its bound, whose sensitivity follows from the
normal equations of the others: dx/db = -(J^T J)^-1 J^T j, with j the column of the unknown on the
bound.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array, counted
from ..estimation import Estimate

SAME_COST = 1e-3
SAME_VALUE = 0.02
"""Relative difference of the sums of squares, and of the unknowns, of one optimum (chosen)."""
SIMILAR_RMS = 0.05
"""Relative increase of the rms residual up to which another optimum is named (chosen)."""
MIN_STANDARD_ERRORS = 3.0
"""Difference of an unknown, in standard errors, that these do not contain (chosen)."""
SMALL_RMS = 0.01
WIDE_RANGE = 0.1
"""Relative increase of the rms residual that is negligible where there is model error, and relative
change of an unknown that is named (both chosen)."""
BOUND_SHIFT = 0.1
"""Shift of a bound, relative to its value, whose effect on the other unknowns is stated
(chosen).
"""
MIN_RECORDS = 3
MAX_SCATTER = 2.0
"""Records from which their scatter is known, and its ratio to the standard error of the rows from
which it counts (chosen): with three records, the scatter is that far above a true standard error in
about 2 % of cases."""
MIN_SEARCHES = 3
MAX_NAMES = 3
"""Number of searches from which a single one at the optimum is named; number of unknowns in a
sentence (chosen).
"""
CONSEQUENCES = {
    "critical_ratio": (
        "The flow law does not describe the records near equal pressures, or they do not reach that"
        " range; the conductance takes up the difference, and the predicted time to the final"
        " pressure is biased. Record the fill until the pressure is steady, or fix the ratio at the"
        " value of the data sheet."
    )
} | dict.fromkeys(
    ("volume", "rest_volume", "growth_volume"),
    "Only the ratio of conductance to volume is determined, so the conductance has the relative"
    " error of this bound and must not be used with another volume. Measure the volume separately,"
    " for example by the water that fills it.",
)
"""Consequence of an unknown on its bound, by the last part of its path."""
RECORD_CONSEQUENCE = (
    "The true value may lie beyond it: give a wider margin, or state the value in the record."
)
"""Consequence of a start time or an initial value on its bound."""
OTHER_CONSEQUENCE = (
    "Extend the bound if it is not physical, or fix the parameter at a measured value."
)


@dataclasses.dataclass(frozen=True, eq=False)
class Optimum:
    """A point where searches ended: the estimates [SI], shape (P,), the sum of squares and the
    number of searches.
    """

    values: Array
    cost: float
    searches: int


def distinct_optima(
    values: Array, costs: Array, scales: Array, margins: Array
) -> tuple[Optimum, ...]:
    """The optima of searches that ended at `values` (S, P) with `costs` (S,), lowest first. Two
    searches ended at one optimum if their sums of squares and all unknowns, relative to their
    values or at least a thousandth of `scales` (P,), agree; start times and initial values relative
    to their `margins` (P,), which are NaN for parameters. Searches without a result are left
    out."""
    optima: list[Optimum] = []
    for point, cost in zip(values[np.isfinite(costs)], costs[np.isfinite(costs)], strict=True):
        for i, optimum in enumerate(optima):
            reference = np.maximum(np.abs(optimum.values), 1e-3 * scales)
            near = np.abs(point - optimum.values) <= SAME_VALUE * np.where(
                np.isnan(margins), reference, margins
            )
            if cost <= (1 + SAME_COST) * optimum.cost + 1e-9 and near.all():
                optima[i] = dataclasses.replace(optimum, searches=optimum.searches + 1)
                break
        else:
            optima.append(Optimum(point, float(cost), 1))
    return tuple(optima)


def searches_at_lowest(costs: Array) -> int:
    """The number of searches with the lowest sum of squares, from all of them (S,), lowest
    first.
    """
    return int(np.count_nonzero(costs <= (1 + SAME_COST) * costs[0] + 1e-9))


def describe_optima(
    optima: Sequence[Optimum], estimates: Sequence[Estimate], costs: Array, margins: Array
) -> list[str]:
    """Sentences on other optima that fit almost as well, or on an optimum that a single search
    reached; `margins` are those of `distinct_optima`."""
    best = optima[0]
    notes = list[str]()
    for optimum in optima[1:]:
        increase = float(np.sqrt(optimum.cost / max(best.cost, 1e-300))) - 1.0
        differences = []
        for e, value, magnitude in zip(
            estimates, optimum.values, _magnitudes(estimates, margins), strict=True
        ):
            change = abs(value - e.value)
            contained = MIN_STANDARD_ERRORS * e.stderr if np.isfinite(e.stderr) else 0.0
            if change > contained and change / magnitude > SAME_VALUE:
                text = f"{e.name} {value:.3g} instead of {e.value:.3g} {e.display_unit}".rstrip()
                differences.append((change / magnitude, text))
        if increase <= SIMILAR_RMS and differences:
            notes.append(
                f"the problem has several optima: {counted(optimum.searches, 'search')} of"
                f" {costs.size} ended where the rms residual is only {100 * increase:.1f} %"
                f" greater, with {_greatest(differences)}; the standard errors describe one optimum"
                " and do not contain this difference"
            )
            break
    if searches_at_lowest(costs) == 1 and costs.size >= MIN_SEARCHES:
        notes.append(
            f"only one of {costs.size} searches reached this optimum, so a lower one may exist and"
            " the standard errors are not reliable; repeat the fit with more starts, or with"
            " narrower bounds"
        )
    return notes


def _magnitudes(estimates: Sequence[Estimate], margins: Array) -> Array:
    """The magnitudes to which changes of the estimates are relative [SI], shape (P,): their values
    or margins.
    """
    values = np.array([max(abs(estimate.value), 1e-300) for estimate in estimates])
    return np.where(np.isnan(margins), values, margins)


def _greatest(changes: list[tuple[float, str]]) -> str:
    """The texts of the greatest changes, the greatest first."""
    return ", ".join(text for _, text in sorted(changes, reverse=True)[:MAX_NAMES])


def describe_flatness(
    estimates: Sequence[Estimate], degrees_of_freedom: int, margins: Array
) -> list[str]:
    """A sentence on the unknowns that change widely at an rms residual that is hardly greater, by
    the linearised fit. The sum of squares grows by one residual variance at a standard error, so
    the rms residual grows by the fraction r at sqrt((2 r + r^2) (N - P)) standard errors. `margins`
    are those of `distinct_optima`."""
    ratio = float(np.sqrt((2 * SMALL_RMS + SMALL_RMS**2) * degrees_of_freedom))
    wide = []
    for e, size in zip(estimates, _magnitudes(estimates, margins), strict=True):
        change = ratio * e.stderr
        if change > WIDE_RANGE * size and ratio > MIN_STANDARD_ERRORS:
            ends = f"{e.value - change:.3g} to {e.value + change:.3g} {e.display_unit}".rstrip()
            wide.append((change / size, f"{e.name} {ends}"))
    text = (
        f"an rms residual that is {100 * SMALL_RMS:.0f} % greater allows {_greatest(wide)}; with"
        " model error, other bounds or another start can give any value in such a range, whatever"
        " the standard error"
    )
    return [text] if wide else []


def describe_bounds(
    estimates: Sequence[Estimate],
    jacobian: Array,
    inverse: Array,
    on_bound: npt.NDArray[np.bool_],
    scales: Array,
    origins: Array,
) -> list[str]:
    """Sentences on every unknown on its bound: no standard error, the consequence, and the effect
    on the others.

    jacobian  of the residuals by the scaled unknowns, shape (R, P)
    inverse   (J^T J)^-1 of the unknowns that are not on a bound, in their order; NaN where
              undetermined
    scales    magnitudes of the unknowns [SI], shape (P,)
    origins   values from which the unknowns are counted [SI], shape (P,)
    """
    inner = np.flatnonzero(~on_bound)
    notes = []
    for k in map(int, np.flatnonzero(on_bound)):
        bound = estimates[k]
        shifts = -inverse @ (jacobian[:, inner].T @ jacobian[:, k]) * scales[inner] / scales[k]
        change = BOUND_SHIFT * (abs(bound.value - origins[k]) or scales[k])
        moved = []
        for e, shift in zip([estimates[int(i)] for i in inner], shifts * change, strict=True):
            if (
                np.isfinite(shift) and abs(shift) > e.stderr
            ):  # false for one without a standard error
                by = f"{e.name} by {shift:+.2g} {e.display_unit}".rstrip()
                text = f"{by} ({abs(shift) / e.stderr:.2g} standard errors)"
                moved.append((abs(shift) / max(abs(e.value), 1e-300), text))
        greater = (
            f"{change:.2g} {bound.display_unit}" if origins[k] else f"{100 * BOUND_SHIFT:.0f} %"
        )
        effect = (
            f" If the bound were {greater} greater, it would move {_greatest(moved)}."
            if moved
            else ""
        )
        value = f"{bound.value:.4g} {bound.display_unit}".rstrip()
        field = bound.name.partition(" of record")[0].rpartition(".")[2].partition("[")[0]
        of_record = bound.name.startswith(("start time", "initial "))
        consequence = (
            RECORD_CONSEQUENCE if of_record else CONSEQUENCES.get(field, OTHER_CONSEQUENCE)
        )
        notes.append(
            f"{bound.name} is on its bound, {value}, and has no standard error; the standard errors"
            f" of the others hold only for this value. {consequence}{effect}"
        )
    return notes


def scatter_of_records(
    estimates: Sequence[Estimate], common: Sequence[Mapping[str, float]]
) -> tuple[tuple[Estimate, ...], list[str]]:
    """The estimates with standard errors of the parameters `common` to the fits without each record
    in turn, by the jackknife over three records or more, where these exceed those of the rows by
    far; and a sentence that says so.
    """
    scattered = list(estimates)
    ratios = dict[str, float]()
    for i, estimate in enumerate(estimates if len(common) >= MIN_RECORDS else ()):
        values = [fit_values[estimate.name] for fit_values in common if estimate.name in fit_values]
        scatter = (
            float(np.std(values)) * np.sqrt(len(values) - 1) if len(values) == len(common) else 0.0
        )
        if scatter > MAX_SCATTER * estimate.stderr:
            ratios[estimate.name] = scatter / estimate.stderr
            scattered[i] = dataclasses.replace(estimate, stderr=scatter)
    note = (
        f"the standard errors of {', '.join(ratios)} are those of the scatter between {len(common)}"
        f" records, up to {max(ratios.values(), default=0.0):.2g} times those of the rows:"
        " something that is not recorded differs between them, such as the temperature of the"
        " room, the supply or a zero"
    )
    return tuple(scattered), [note] if ratios else []
