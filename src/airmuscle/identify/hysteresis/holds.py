"""Holds: stretches in which pressure and load, or pressure and length, stay, so that what moves is creep."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from ...core.arrays import Array
from ...recording import Recording
from ...recording.segment import Interval, find_plateaus
from ...recording.segment.runs import BAND
from ...recording.segment.sensor import noise_of
from ...recording.segment.stretch import level_stretches

MIN_ROWS = 12
"""Rows that a fit of creep needs."""
LENGTH_TOLERANCE = 5e-4
"""Contraction within which a frame holds the length (chosen)."""


@dataclasses.dataclass(frozen=True)
class Hold:
    """Rows of a hold, and which quantity creeps in it: the contraction under a load, the force at a length."""

    interval: Interval
    quantity: str


def find_holds(recording: Recording) -> Iterator[Hold]:
    """The holds of a recording among its plateaus of pressure; none without time."""
    force, contraction = recording["force"], recording["contraction"]
    for plateau in find_plateaus(recording):
        if len(plateau.stretch) >= MIN_ROWS and np.ptp(force[plateau.stretch.rows]) <= BAND * np.abs(force).max():
            yield Hold(plateau.stretch, "contraction")
            continue
        for level in level_stretches(contraction, LENGTH_TOLERANCE, within=plateau.stretch):
            still = _trim_to_level(contraction, level)
            if len(still) >= MIN_ROWS:
                yield Hold(still, "force")


def _trim_to_level(values: Array, level: Interval) -> Interval:
    """The stretch without the rows on the way to its level and away from it."""
    inside = values[level.rows]
    near = np.flatnonzero(np.abs(inside - np.median(inside)) <= max(LENGTH_TOLERANCE / 10.0, 4.0 * noise_of(inside)))
    return Interval(level.start + int(near[0]), level.start + int(near[-1]) + 1) if near.size else Interval(0, 0)
