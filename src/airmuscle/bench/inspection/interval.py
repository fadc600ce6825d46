"""Levels of a quantity: intervals of consecutive rows within a band, and static points, whose order
has no meaning.

The results of an analysis are remembered with their recordings.
"""

import dataclasses
import functools
import weakref
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording.columns import MOVED
from ...recording.recording import Recording
from .resolution import rounding

Analysis = TypeVar("Analysis", bound=Callable[..., Any])
_Known = dict[tuple[int | str, ...], tuple[tuple[weakref.ref[Recording], ...], Any]]


def _are_alive(
    references: tuple[weakref.ref[Recording], ...], recordings: tuple[Recording, ...]
) -> bool:
    """Whether weak references are still those of these recordings."""
    pairs = zip(references, recordings, strict=True)
    return all(reference() is recording for reference, recording in pairs)


def remembered(analyse: Analysis) -> Analysis:
    """The function of a recording, or of several, whose result is remembered as long as the first
    of them.

    Calls with further arguments that are no texts are not remembered.
    """
    results: weakref.WeakKeyDictionary[Recording, _Known] = weakref.WeakKeyDictionary()

    @functools.wraps(analyse)
    def remembering(*arguments: Any, **options: Any) -> Any:
        if options or not arguments or not all(isinstance(text, str) for text in arguments[1:]):
            return analyse(*arguments, **options)
        recordings, *texts = arguments
        several = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
        if not several:
            return analyse(*arguments)
        known = results.setdefault(several[0], {})
        key = (*map(id, several), *texts)
        stored = known.get(key)
        # an id is given again after its recording has gone, so the recordings are compared, too
        if stored is None or not _are_alive(stored[0], several):
            references = tuple(map(weakref.ref, several))
            stored = known[key] = references, analyse(recordings, *texts)
        return stored[1]

    return remembering  # type: ignore[return-value]


Mask = npt.NDArray[np.bool_]

POINT_COLUMNS = ("pressure", "contraction", "force")
"""Columns of a static point."""
_MAX_WINDOW_VALUES = 1_000_000
"""Maximum number of values of the windows that are sorted at once, for the memory (chosen)."""


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


def spread(values: Array) -> float:
    """The width of the band that contains 98 % of the values, so that a single outlier does not
    count.
    """
    low, high = np.quantile(values, [0.01, 0.99])
    return float(high - low)


def true_intervals(mask: Mask) -> list[Interval]:
    """The intervals in which a mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [Interval(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


EDGE = 1e-6
"""Relative excess at which a level is still within its band (chosen): the steps of a test rig are
often exact fractions of its range, and must not be decided by rounding."""


def level_intervals(
    values: Array, band: float, *, within: Interval | None = None
) -> Iterator[Interval]:
    """Consecutive intervals, each as long as possible, whose values fit into a band of width
    `band`.
    """
    start, end = (within.start, within.stop) if within else (0, len(values))
    while start < end:
        size = 64
        is_outside = np.zeros(0, dtype=bool)
        while not is_outside.any() and is_outside.size < end - start:  # in windows of doubling size
            window = values[start : min(start + size, end)]
            width = np.maximum.accumulate(window) - np.minimum.accumulate(window)
            is_outside = width > band * (1.0 + EDGE)
            size *= 2
        stop = start + int(np.argmax(is_outside)) if is_outside.any() else end
        yield Interval(start, stop)
        start = stop


def running_median(values: Array, width: int) -> Array:
    """The centred moving median over `width` rows (an odd number); windows are shorter at both
    ends.
    """
    if width < 3 or len(values) < 3:
        return values
    padded = np.pad(np.asarray(values, dtype=float), width // 2, constant_values=np.nan)
    rows = max(1, _MAX_WINDOW_VALUES // width)
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)
    medians = []
    for first in range(0, len(values), rows):
        ordered = np.sort(windows[first : first + rows], axis=1)  # NaN last
        values_in_window = np.count_nonzero(~np.isnan(ordered), axis=1)
        count = np.maximum(values_in_window, 1)[:, None]
        middle = np.hstack([(count - 1) // 2, count // 2])
        low, high = np.take_along_axis(ordered, middle, axis=1).T
        medians.append(np.where(low == high, low, 0.5 * (low + high)))
    return np.concatenate(medians)


LEVEL_WIDTHS = (0.02, 0.01, 0.005, 0.002)
"""Maximum widths of a level, as fractions of the range of the quantity, the first that separates
levels (chosen).
"""
MIN_LEVELS = 3
MIN_ROWS = 3
"""Minimum number of levels of pressure, and of the length, and minimum mean number of rows of a
level (chosen).
"""
MIN_COVERAGE = 0.5
"""Minimum share of the combinations of two levels that have a row (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class StaticPoints:
    """The number of the pressure level and of the length level of each row, from 0, shape (N,)
    each.
    """

    pressure_level: npt.NDArray[np.int64]
    length_level: npt.NDArray[np.int64]
    moved: str
    """The column of the length."""

    @property
    def description(self) -> str:
        """The points and their levels as a phrase."""
        pressures = int(self.pressure_level.max()) + 1
        lengths = int(self.length_level.max()) + 1
        return (
            f"{self.pressure_level.size} static points at {pressures} pressures and {lengths}"
            f" {self.moved}s"
        )


@remembered
def find_static_points(recording: Recording) -> StaticPoints | None:
    """The levels of a recording without time whose rows are static points; None for any other
    recording.

    Each row has one of several pressures and one of several lengths, and most combinations of them
    occur. The order of such rows has no meaning, so that they show neither noise nor saturation nor
    branches.
    """
    moved = next((name for name in MOVED if name in recording.columns), None)
    if (
        "time" in recording
        or moved is None
        or "pressure" not in recording.columns
        or not len(recording)
    ):
        return None
    pressure = _levels(recording["pressure"])
    length = _levels(recording[moved])
    if pressure is None or length is None:
        return None
    occurring = np.unique(np.column_stack([pressure, length]), axis=0).shape[0]
    combinations = (int(pressure.max()) + 1) * (int(length.max()) + 1)
    return (
        StaticPoints(pressure, length, moved) if occurring >= MIN_COVERAGE * combinations else None
    )


def _levels(values: Array) -> npt.NDArray[np.int64] | None:
    """The number of the level of each value (N,); None unless the values are at several separate
    levels.
    """
    span = float(np.ptp(values)) if np.isfinite(values).all() else 0.0
    if not span > rounding("", values):
        return None
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    steps = np.diff(ordered)
    for width in LEVEL_WIDTHS:
        gap = width * span * (1.0 + EDGE)
        starts = np.concatenate([[0], np.flatnonzero(steps > gap) + 1])
        if starts.size < MIN_LEVELS or values.size < MIN_ROWS * starts.size:
            continue
        ends = np.append(starts[1:], values.size)
        if (ordered[ends - 1] - ordered[starts] <= gap).all():
            numbers = np.empty(values.size, dtype=np.int64)
            numbers[order] = np.repeat(np.arange(starts.size), ends - starts)
            return numbers
    return None
