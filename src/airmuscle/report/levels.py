"""Levels of a quantity that a test rig keeps constant, for curves through the measured points."""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array
from .isobar_plot import PRESSURE_TOLERANCE


def levels_of(values: Array, max_count: int) -> Array:
    """Return the levels of a measured quantity, at most `max_count` of them, evenly selected, in its unit.

    A level is the median of values closer together than a test rig controls them; a ramp gives quantiles.
    """
    ordered = np.sort(values)
    ends = np.flatnonzero(np.diff(ordered) > PRESSURE_TOLERANCE * np.abs(ordered).max()) + 1
    levels = np.array([np.median(group) for group in np.split(ordered, ends)])
    if levels.size == 1 and np.ptp(ordered) > 2 * PRESSURE_TOLERANCE * np.abs(ordered).max():  # a ramp has no levels
        return np.asarray(np.quantile(ordered, np.linspace(0.1, 0.9, max_count)))
    if levels.size <= max_count:
        return levels
    return np.asarray(levels[np.unique(np.linspace(0, levels.size - 1, max_count).astype(int))])
