"""Resolution of a column: what two readings must differ by to be different.

Every detector asks this file, so that none depends on the last digits. Readings are the same within
rounding, `ROUNDING` of their magnitude, or within a quarter of a count; a quantity is constant
within `constant_band`. Readings of a value between two counts jitter by one count, and a held one
drifts by one.
"""

import math

import numpy as np
import numpy.typing as npt

from ...core import Array

ROUNDING = 1e-9
"""Difference below this fraction of the readings is rounding (chosen)."""
SAME_READING = 0.25
"""Difference in counts below which two readings are of the same count (chosen)."""
RELATIVE_BAND = 0.02
"""Band of a constant quantity, as a fraction of its maximum (chosen)."""
CONTRACTION_BAND = 0.005
"""Band of a constant contraction, and of a constant length as a fraction of its maximum
(chosen).
"""
MIN_DISTINCT_VALUES = 15
"""Minimum number of distinct readings for a resolution, unless the quantity is held; fewer may be
the set points of the test (chosen).
"""
MAX_RMS_OFFSET = 0.12
"""Maximum RMS distance of the differences from multiples of the step, in steps (chosen; random
differences: 0.29).
"""
MIN_SHARE = 0.05
"""Minimum share of the rows with a reading that recurs (chosen)."""
SAME_CELL = 0.05
"""Readings closer than this fraction of a step are the same reading, written in two ways
(chosen).
"""


def magnitude(name: str, values: Array) -> float:
    """The magnitude of the readings (N,) of a column, to which bands and rounding are relative: of
    a contraction 1, the resting length, from which it was computed; 0 without readings.
    """
    if name.rpartition(".")[2] == "contraction":
        return 1.0
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def rounding(name: str, values: Array) -> float:
    """The difference of two readings of a column (N,) that rounding explains."""
    return ROUNDING * magnitude(name, values)


def constant_band(name: str, values: Array) -> float:
    """The band in which a column with these readings (N,) counts as constant."""
    narrow = name.rpartition(".")[2] in ("contraction", "length")
    return magnitude(name, values) * (CONTRACTION_BAND if narrow else RELATIVE_BAND)


def time_rounding(time: Array) -> float:
    """The difference [s] by which equal times may differ through rounding; times may count from
    1970.
    """
    if not len(time):
        return 0.0
    return float(ROUNDING * np.ptp(time) + 8.0 * np.spacing(np.max(np.abs(time))))


def reading_numbers(values: Array, tolerance: float | None = None) -> npt.NDArray[np.intp]:
    """The number of the distinct reading of each value (N,), from 0 in ascending order. Readings
    that differ by no more than the tolerance, by default that of rounding, are the same.
    """
    least = rounding("", values) if tolerance is None else tolerance
    order = np.argsort(values, kind="stable")
    steps = np.diff(values[order], prepend=values[order][:1]) > least
    numbers = np.empty(len(values), dtype=np.intp)
    numbers[order] = np.cumsum(steps)
    return numbers


def merged_readings(values: Array) -> Array:
    """The values (N,), each replaced by the lowest of the readings that are the same within
    rounding; missing ones stay.
    """
    merged = np.array(values, dtype=float)
    known = np.isfinite(merged)
    if known.any():
        merged[known] = distinct_readings(merged[known])[reading_numbers(merged[known])]
    return merged


def distinct_readings(values: Array, tolerance: float | None = None) -> Array:
    """The distinct readings (K,) among values (N,) in ascending order, the lowest of those that are
    the same as for `reading_numbers`.
    """
    least = rounding("", values) if tolerance is None else tolerance
    ordered = np.unique(values)
    return ordered[np.diff(ordered, prepend=-math.inf) > least]


def estimate_resolution(values: Array, held_band: float = 0.0) -> float:
    """The largest step of which the differences of adjacent readings are multiples; 0 if there is
    none.

    The few readings of a quantity that stays within `held_band` are counts; elsewhere they may be
    set points.
    """
    known = values[np.isfinite(values)]
    distinct = distinct_readings(known)
    if len(distinct) < 2:
        return 0.0
    if len(distinct) < MIN_DISTINCT_VALUES:
        is_held = float(distinct[-1] - distinct[0]) <= held_band
        return _count_of_held(known, distinct) if is_held else 0.0
    gaps = np.diff(distinct)
    for candidate in sorted(
        {float(q) for q in np.quantile(gaps, [0.02, 0.1, 0.25, 0.5])}, reverse=True
    ):
        # One reading may be written in two ways, 71.70 and 71.71; both count as one.
        steps = np.diff(distinct[np.concatenate(([True], gaps > SAME_CELL * candidate))])
        step = candidate
        differences = steps[steps < 8.5 * candidate]
        for _ in range(3):  # the least-squares step of differences of a few steps
            counts = np.round(differences / step)
            total = float(counts @ counts)
            step = float(counts @ differences) / total if total else 0.0
            if not total:
                break
        if step > 0.0 and _are_multiples(steps, step):
            return step
    return 0.0


def _count_of_held(values: Array, distinct: Array) -> float:
    """The least difference of the readings that recur in a held quantity (N,); 0 for a single one.
    Those of the way to its level do not recur.
    """
    shares = np.bincount(reading_numbers(values)) / len(values)
    recurring = distinct[shares >= MIN_SHARE]
    return float(np.diff(recurring).min()) if len(recurring) > 1 else 0.0


def _are_multiples(steps: Array, step: float) -> bool:
    """Whether nearly all small differences are integer multiples of a step, and enough of them are
    single steps.
    """
    small = steps[steps < 8.5 * step] / step
    count = len(small)
    multiples = np.round(small)
    offset = small - multiples
    if count < 10 or math.sqrt(float(offset @ offset) / count) >= MAX_RMS_OFFSET:
        return False
    return bool(
        np.count_nonzero(multiples == 1) >= 3 and np.count_nonzero(multiples > 0) > 0.98 * count
    )
