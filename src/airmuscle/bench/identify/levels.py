"""Levels of a quantity that a test rig keeps constant, for curves through the measured points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.arrays import Array

LEVEL_TOLERANCE = 0.005
"""Maximum difference between neighbouring values of a level, as a fraction of the maximum (chosen)."""
MAX_LEVEL_WIDTH = 3.0
"""Maximum width of a level, in the difference of neighbours; a wider group of values is a ramp (chosen)."""
HELD_FRACTION = 0.9
"""Minimum fraction of the rows at levels for a quantity that is held (chosen)."""
ROUND_DIGITS = 2
"""Significant digits of the levels that are chosen on a ramp."""


class HeldLevels(NamedTuple):
    """Levels of a quantity, in increasing order, and the fraction of the rows at them."""

    values: Array
    fraction: float

    @property
    def held(self) -> bool:
        """Whether the quantity was held, apart from few rows."""
        return self.fraction >= HELD_FRACTION


def held_levels(values: Array) -> HeldLevels:
    """Return the levels of a measured quantity: medians of groups of values, without groups that a ramp fills."""
    ordered = np.sort(values)
    tolerance = LEVEL_TOLERANCE * float(np.abs(ordered).max())
    ends = np.flatnonzero(np.diff(ordered) > tolerance) + 1
    groups = [group for group in np.split(ordered, ends) if np.ptp(group) <= MAX_LEVEL_WIDTH * tolerance]
    return HeldLevels(np.array([np.median(group) for group in groups]), sum(map(len, groups)) / ordered.size)


def levels_of(values: Array, max_count: int) -> Array:
    """Return the levels of a measured quantity, at most `max_count` of them, evenly selected, in its unit.

    A level is the median of values closer together than a test rig controls them. A ramp gives quantiles, rounded to
    two significant digits.
    """
    levels = held_levels(values)
    if levels.fraction < 0.5:
        quantiles = np.quantile(values, np.linspace(0.1, 0.9, max_count))
        return np.unique([float(f"{value:.{ROUND_DIGITS - 1}e}") for value in quantiles])
    if levels.values.size <= max_count:
        return levels.values
    return np.asarray(levels.values[np.unique(np.linspace(0, levels.values.size - 1, max_count).astype(int))])


def is_pressure_ramp(pressure: Array, contraction: Array) -> bool:
    """Whether the pressure was swept at held contractions [Pa, 1], as in isometric tests."""
    return held_levels(contraction).held and held_levels(pressure).fraction < 0.5
