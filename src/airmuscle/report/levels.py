"""The levels at which a bench held a quantity, for curves through its points."""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array
from .chart import SAME_PRESSURE


def levels_of(values: Array, most: int) -> Array:
    """The medians of groups that lie closer together than a bench holds them, at most so many, spread evenly."""
    ordered = np.sort(values)
    ends = np.flatnonzero(np.diff(ordered) > SAME_PRESSURE * np.abs(ordered).max()) + 1
    levels = np.array([np.median(group) for group in np.split(ordered, ends)])
    if levels.size == 1 and np.ptp(ordered) > 2 * SAME_PRESSURE * np.abs(ordered).max():  # a ramp has no levels
        return np.asarray(np.quantile(ordered, np.linspace(0.1, 0.9, most)))
    if levels.size <= most:
        return levels
    return np.asarray(levels[np.unique(np.linspace(0, levels.size - 1, most).astype(int))])
