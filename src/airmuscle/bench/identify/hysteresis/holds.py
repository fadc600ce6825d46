"""Holds: intervals of constant pressure and load, or constant pressure and length, in which the muscle creeps."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from ....core.arrays import Array
from ....recording import Recording
from ...segment import Interval, find_plateaus
from ...segment.interval import level_intervals
from ...segment.runs import RELATIVE_BAND
from ...segment.sensor import estimate_noise

MIN_ROWS = 12
"""Minimum number of rows for a fit of creep."""
LENGTH_TOLERANCE = 5e-4
"""Range of contraction within which the length counts as constant (chosen)."""
DRIFT = 2.0
"""Change of the level of a quantity that creeps, in standard deviations of its noise (chosen)."""


@dataclasses.dataclass(frozen=True)
class Hold:
    """The rows of a hold, and the quantity that creeps: contraction under a load, force at a constant length."""

    interval: Interval
    quantity: str


def find_holds(recording: Recording) -> Iterator[Hold]:
    """The holds among the pressure plateaus of a recording; none without a time column."""
    force, contraction = recording["force"], recording["contraction"]
    for plateau in find_plateaus(recording, columns=("pressure",)):
        rows = plateau.interval.rows
        has_constant_force = np.ptp(force[rows]) <= RELATIVE_BAND * np.abs(force).max()
        relaxes = _drifts(force[rows]) and not _drifts(contraction[rows])
        if len(plateau.interval) >= MIN_ROWS and has_constant_force and not relaxes:
            yield Hold(plateau.interval, "contraction")
            continue
        for level in level_intervals(contraction, LENGTH_TOLERANCE, within=plateau.interval):
            interval = _trim_to_level(contraction, level)
            if len(interval) >= MIN_ROWS:
                yield Hold(interval, "force")


def _drifts(values: Array) -> bool:
    """Whether the level of the values changes beyond their noise from the first to the last quarter of the rows."""
    quarter = max(values.size // 4, 1)
    return bool(abs(np.median(values[-quarter:]) - np.median(values[:quarter])) > DRIFT * estimate_noise(values))


def _trim_to_level(values: Array, level: Interval) -> Interval:
    """The interval without the transitions to and from its level."""
    inside = values[level.rows]
    near = np.flatnonzero(
        np.abs(inside - np.median(inside)) <= max(LENGTH_TOLERANCE / 10.0, 4.0 * estimate_noise(inside))
    )
    return Interval(level.start + int(near[0]), level.start + int(near[-1]) + 1) if near.size else Interval(0, 0)
