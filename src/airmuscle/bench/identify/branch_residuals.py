"""Difference of the residuals of inflating and deflating rows, which shows hysteresis in a static fit."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import Hint, HintedText
from ...recording import Recording
from ...recording.columns import QUANTITIES
from ..segment import branch_directions, estimate_sensors, find_branches
from ..segment.branches import branch_name
from ..segment.remembered import remembered

MIN_BRANCH_ROWS = 5
"""Minimum number of rows of a branch (chosen); the jump between two levels of a map is no branch."""
BINS = 12
"""Intervals of the driven quantity in each recording within which the two branches are compared (chosen)."""
MIN_BINS = 3
"""Minimum number of intervals with rows of both branches (chosen)."""
MIN_STANDARD_ERRORS = 3.0
"""Standard errors above which the mean difference is not random (chosen)."""


class _BranchBins(NamedTuple):
    """Mask of the rows with a pressure; of these the direction (1 inflating or contracting, -1 deflating or extending)
    and the interval of the driven quantity, whose column is named."""

    known: npt.NDArray[np.bool_]
    direction: Array
    bins: npt.NDArray[np.intp]
    column: str


_known: weakref.WeakKeyDictionary[Recording, _BranchBins] = weakref.WeakKeyDictionary()
"""Branches by recording: a comparison asks for the same recordings for every law."""


def branch_distance(runs: Sequence[Recording], residuals: Sequence[Array], quantity: str) -> float:
    """The distance [SI] of the two branches that the residuals of a fit follow; 0 if they follow none.

    runs        the recordings of the fit
    residuals   residual (model - measured) of each row of each recording [SI], NaN for rows that are not measured
    quantity    name of the fitted quantity

    The medians of both branches are compared at equal driven quantity, so that neither an error of the law that both
    share nor an outlier counts. Their average difference must exceed three standard errors and the standard deviation
    of the sensor.
    """
    differences = np.concatenate([_branch_differences(*pair) for pair in zip(runs, residuals, strict=True)])
    if differences.size < MIN_BINS:
        return 0.0
    mean = abs(float(np.mean(differences)))
    standard_error = float(np.std(differences, ddof=1) / np.sqrt(differences.size))
    if mean <= MIN_STANDARD_ERRORS * standard_error or mean <= _sensor_deviation(runs, quantity):
        return 0.0
    return mean


def branch_notes(runs: Sequence[Recording], distance: float, quantity: str, *, delayed: bool = False) -> list[str]:
    """The remark that the residuals of a fit follow two branches at a distance [SI]; empty without a distance.

    `delayed` is whether a delay of a sensor explains them, so that they are not friction.
    """
    if not distance:
        return []
    unit = QUANTITIES[quantity].unit
    text = f"{100 * distance:.3g} %" if unit == "1" else f"{distance:.3g} {unit}"
    columns = {column for run in runs if (column := _known[run].column)}
    names = [" and ".join(branch_name(column, d) for d in (1, -1)) for column in sorted(columns, reverse=True)]
    return [
        HintedText(
            f"The residuals follow two branches, {text} apart on average ({'; '.join(dict.fromkeys(names))}).",
            *([] if delayed else [Hint("To identify the friction", function="bench.fit_hysteresis")]),
        )
    ]


def _branch_differences(run: Recording, residuals: Array) -> Array:
    """Median residual of inflating or contracting rows minus that of the others, by interval; shape (intervals,)."""
    if run not in _known:
        _known[run] = _branch_bins(run)
    known, direction, bins, _ = _known[run]
    if not direction.any():
        return np.zeros(0)
    values = residuals[known]
    used = np.isfinite(values) & (direction != 0)
    cell = 2 * bins[used] + (direction[used] > 0)
    parts = np.split(values[used][np.argsort(cell, kind="stable")], np.cumsum(np.bincount(cell, minlength=2 * BINS)))
    down, up = parts[0 : 2 * BINS : 2], parts[1 : 2 * BINS : 2]
    return np.array([float(np.median(a) - np.median(b)) for a, b in zip(up, down, strict=True) if a.size and b.size])


def _branch_bins(run: Recording) -> _BranchBins:
    known = np.isfinite(run["pressure"])
    complete = run if known.all() else run.rows(known)
    branches = tuple(each for each in find_branches(complete) if len(each.interval) >= MIN_BRANCH_ROWS)
    if len({branch.direction for branch in branches}) < 2:
        return _BranchBins(known, np.zeros(0), np.zeros(0, dtype=np.intp), "")
    column = branches[0].column
    driven = complete[column]
    edges = np.linspace(driven.min(), driven.max(), BINS + 1)[1:-1]
    return _BranchBins(known, branch_directions(complete, branches), np.digitize(driven, edges), column)


def _sensor_deviation(runs: Sequence[Recording], quantity: str) -> float:
    """Standard deviation of one reading of the quantity [SI]; 0 where it cannot be estimated."""
    known = _deviations(runs)
    if quantity not in known:
        columns = [run[quantity][np.isfinite(run[quantity])] for run in runs]
        sensors = estimate_sensors([Recording({quantity: values}, "fit") for values in columns if values.size])
        known[quantity] = sensors[quantity].std if quantity in sensors else 0.0
    return known[quantity]


@remembered
def _deviations(runs: Sequence[Recording]) -> dict[str, float]:
    """The standard deviations of the sensors that are known, by quantity: a comparison asks for them for every law."""
    return {}
