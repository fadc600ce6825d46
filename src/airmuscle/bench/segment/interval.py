"""Intervals of consecutive rows in which a quantity stays within a band."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array

Mask = npt.NDArray[np.bool_]


@dataclasses.dataclass(frozen=True)
class Interval:
    """Rows from `start` up to, but not including, `stop`, counted from 0."""

    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def rows(self) -> slice:
        """The rows as a slice, to index columns or for Recording.rows."""
        return slice(self.start, self.stop)


def true_intervals(mask: Mask) -> list[Interval]:
    """The intervals in which a mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [Interval(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def level_intervals(values: Array, band: float, *, within: Interval | None = None) -> Iterator[Interval]:
    """Consecutive intervals, each as long as possible, whose values fit into a band of width `band`."""
    whole = within or Interval(0, len(values))
    start = whole.start
    while start < whole.stop:
        stop = _first_row_outside(values[: whole.stop], start, band)
        yield Interval(start, stop)
        start = stop


def _first_row_outside(values: Array, start: int, band: float) -> int:
    """The first row after `start` that does not fit into the band, searched in windows of doubling size."""
    size = 64
    while True:
        window = values[start : start + size]
        outside = np.maximum.accumulate(window) - np.minimum.accumulate(window) > band
        if outside.any():
            return start + int(np.argmax(outside))
        if start + size >= len(values):
            return len(values)
        size *= 2


def running_median(values: Array, width: int) -> Array:
    """The centred moving median over `width` rows (an odd number); windows are shorter at both ends."""
    if width < 3 or len(values) < 3:
        return values
    import pandas as pd

    return np.asarray(pd.Series(values).rolling(width, center=True, min_periods=1).median(), dtype=float)
