"""Difference of the residuals of inflating and deflating rows, which shows hysteresis in a static fit."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.hints import Hint, HintedText
from ..recording import Recording
from ..recording.columns import QUANTITIES
from ..recording.segment import branch_directions, estimate_sensors, find_branches

MIN_BRANCH_ROWS = 5
"""Minimum number of rows of a branch (chosen); the jump between two levels of a map is no branch."""
PRESSURE_BINS = 12
"""Intervals of pressure in each recording within which the two branches are compared (chosen)."""
MIN_BINS = 3
"""Minimum number of intervals with rows of both branches (chosen)."""
MIN_STANDARD_ERRORS = 3.0
"""Standard errors above which the mean difference is not random (chosen)."""


class _BranchBins(NamedTuple):
    """Mask of the rows with a pressure; of these the direction (1 inflating, -1 deflating) and the interval."""

    known: npt.NDArray[np.bool_]
    direction: Array
    bins: npt.NDArray[np.intp]


_known: weakref.WeakKeyDictionary[Recording, _BranchBins] = weakref.WeakKeyDictionary()
"""Branches by recording: a comparison asks for the same recordings for every law."""


def branch_notes(runs: Sequence[Recording], residuals: Sequence[Array], quantity: str) -> list[str]:
    """The remark that the residuals of a fit follow two branches; empty if they do not.

    runs        the recordings of the fit
    residuals   residual (model - measured) of each row of each recording [SI], NaN for rows that are not measured
    quantity    name of the fitted quantity

    The means of both branches are compared at equal pressure, so that an error of the law that both share does not
    count. Their average difference must exceed three standard errors and the standard deviation of the sensor.
    """
    differences = np.concatenate([_branch_differences(*pair) for pair in zip(runs, residuals, strict=True)])
    if differences.size < MIN_BINS:
        return []
    mean = abs(float(np.mean(differences)))
    standard_error = float(np.std(differences, ddof=1) / np.sqrt(differences.size))
    if mean <= MIN_STANDARD_ERRORS * standard_error or mean <= _sensor_deviation(runs, quantity):
        return []
    unit = QUANTITIES[quantity].unit
    distance = f"{100 * mean:.3g} %" if unit == "1" else f"{mean:.3g} {unit}"
    return [
        HintedText(
            f"The residuals follow two branches, {distance} apart on average (inflating and deflating).",
            Hint("To identify the friction", function="identify.hysteresis.fit_hysteresis"),
        )
    ]


def _branch_differences(run: Recording, residuals: Array) -> Array:
    """Mean residual of the inflating minus that of the deflating rows, by interval of pressure; shape (intervals,)."""
    if run not in _known:
        _known[run] = _branch_bins(run)
    known, direction, bins = _known[run]
    if not direction.any():
        return np.zeros(0)
    values = residuals[known]
    used = np.isfinite(values) & (direction != 0)
    cell = 2 * bins[used] + (direction[used] > 0)
    counts = np.bincount(cell, minlength=2 * PRESSURE_BINS).reshape(PRESSURE_BINS, 2)
    sums = np.bincount(cell, values[used], minlength=2 * PRESSURE_BINS).reshape(PRESSURE_BINS, 2)
    down, up = (sums / np.maximum(counts, 1)).T
    return np.asarray((up - down)[(counts > 0).all(axis=1)])


def _branch_bins(run: Recording) -> _BranchBins:
    known = np.isfinite(run["pressure"])
    complete = run.rows(known)
    branches = tuple(each for each in find_branches(complete) if len(each.interval) >= MIN_BRANCH_ROWS)
    if len({branch.direction for branch in branches}) < 2:
        return _BranchBins(known, np.zeros(0), np.zeros(0, dtype=np.intp))
    pressure = complete["pressure"]
    edges = np.linspace(pressure.min(), pressure.max(), PRESSURE_BINS + 1)[1:-1]
    return _BranchBins(known, branch_directions(complete, branches), np.digitize(pressure, edges))


def _sensor_deviation(runs: Sequence[Recording], quantity: str) -> float:
    """Standard deviation of one reading of the quantity [SI]; 0 where it cannot be estimated."""
    columns = [run[quantity][np.isfinite(run[quantity])] for run in runs]
    sensors = estimate_sensors([Recording({quantity: values}, "fit") for values in columns if values.size])
    return sensors[quantity].std if quantity in sensors else 0.0
