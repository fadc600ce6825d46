"""Static points: a force map without time, whose rows are steady states at levels of pressure and of length."""

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording.columns import MOVED
from ...recording.recording import Recording
from .interval import remembered

LEVEL_WIDTHS = (0.02, 0.01, 0.005, 0.002)
"""Maximum widths of a level, as fractions of the range of the quantity, the first that separates levels (chosen)."""
MIN_LEVELS = 3
"""Minimum number of levels of pressure, and of the length (chosen)."""
MIN_ROWS = 3
"""Minimum mean number of rows of a level (chosen)."""
MIN_COVERAGE = 0.5
"""Minimum share of the combinations of two levels that have a row (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class StaticPoints:
    """The number of the pressure level and of the length level of each row, from 0, shape (N,) each."""

    pressure_level: npt.NDArray[np.int64]
    length_level: npt.NDArray[np.int64]
    moved: str
    """The column of the length."""

    @property
    def description(self) -> str:
        """The points and their levels as a phrase."""
        pressures, lengths = int(self.pressure_level.max()) + 1, int(self.length_level.max()) + 1
        return f"{self.pressure_level.size} static points at {pressures} pressures and {lengths} {self.moved}s"


@remembered
def find_static_points(recording: Recording) -> StaticPoints | None:
    """The levels of a recording without time whose rows are static points; None for any other recording.

    Each row has one of several pressures and one of several lengths, and most combinations of them occur. The order of
    such rows has no meaning, so that they show neither noise nor saturation nor branches.
    """
    moved = next((name for name in MOVED if name in recording.columns), None)
    if "time" in recording or moved is None or "pressure" not in recording.columns or not len(recording):
        return None
    pressure, length = _levels(recording["pressure"]), _levels(recording[moved])
    if pressure is None or length is None:
        return None
    occurring = np.unique(np.column_stack([pressure, length]), axis=0).shape[0]
    combinations = (int(pressure.max()) + 1) * (int(length.max()) + 1)
    return StaticPoints(pressure, length, moved) if occurring >= MIN_COVERAGE * combinations else None


def _levels(values: Array) -> npt.NDArray[np.int64] | None:
    """The number of the level of each value (N,); None unless the values are at several separate levels."""
    span = float(np.ptp(values)) if np.isfinite(values).all() else 0.0
    if not span > 0:
        return None
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    steps = np.diff(ordered)
    for width in LEVEL_WIDTHS:
        starts = np.concatenate([[0], np.flatnonzero(steps > width * span) + 1])
        if starts.size < MIN_LEVELS or values.size < MIN_ROWS * starts.size:
            continue
        ends = np.append(starts[1:], values.size)
        if (ordered[ends - 1] - ordered[starts] <= width * span).all():
            numbers = np.empty(values.size, dtype=np.int64)
            numbers[order] = np.repeat(np.arange(starts.size), ends - starts)
            return numbers
    return None
