"""Time series of a law and of the force on even grids, and what sensors and the muscle make of
them: a delay, a low-pass filter, a moving average, a slow response, and a slip of friction.
"""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording import Recording
from .branch_residuals import row_directions

MAX_RUNS = 40
MAX_POINTS = 4000
MIN_POINTS_OF_RUN = 150
MAX_POINTS_OF_RUN = 1000
"""Number of runs and of points of all runs, least and greatest number of one (chosen)."""
ROW_ROUNDING = 1e-6
"""Distance from a row, in rows, that is rounding (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Traces:
    """R runs on even grids of n points; columns of shape (R, n)."""

    modelled: Array
    measured: Array
    """The force of the law and of the sensor [N]."""
    residual: Array
    """modelled - measured; 0 where it is not known."""
    is_known: npt.NDArray[np.bool_]
    pressure: Array
    contraction: Array
    """On a scale from -1 to 1 of all rows."""
    direction: Array
    step: Array
    """Time between two points [s], shape (R,); 0 of runs without time."""
    relative_contraction: Array
    """The contraction over the greatest one."""
    pressure_scale: float
    contraction_scale: float
    """Change on the scale for a change by one unit [1/Pa] and of the contraction."""

    @classmethod
    def of(cls, recordings: Sequence[Recording], residuals: Sequence[Array]) -> "Traces":
        """The traces of the recordings, of which an evenly spaced part is taken where there are
        many."""
        pairs = [
            (recording, residual)
            for recording, residual in zip(recordings, residuals, strict=True)
            if np.count_nonzero(np.isfinite(residual)) > 2
        ]
        pairs = pairs[:: -(-len(pairs) // MAX_RUNS) or 1]
        most = max((len(recording) for recording, _ in pairs), default=0)
        limit = MAX_POINTS // max(len(pairs), 1)
        points = min(most, int(np.clip(limit, MIN_POINTS_OF_RUN, MAX_POINTS_OF_RUN)))
        grids = [_Grid.of(recording, points) for recording, _ in pairs]
        residual = _stacked(grids, [values for _, values in pairs])
        columns = {
            name: _stacked(grids, [recording[name] for recording, _ in pairs])
            for name in ("pressure", "contraction", "force")
        }
        is_known = np.isfinite(residual + sum(columns.values()))
        filled = {name: _filled(values) for name, values in columns.items()}
        known_residual = np.where(is_known, residual, 0.0)
        greatest = float(np.max(np.abs(filled["contraction"]), initial=0.0))
        return cls(
            modelled=filled["force"] + known_residual,
            measured=filled["force"],
            residual=known_residual,
            is_known=is_known,
            pressure=scaled(filled["pressure"]),
            contraction=scaled(filled["contraction"]),
            direction=_stacked(grids, [row_directions(recording) for recording, _ in pairs]),
            step=np.array([grid.step for grid in grids]),
            relative_contraction=filled["contraction"] / max(greatest, 1e-300),
            pressure_scale=_scale(filled["pressure"]),
            contraction_scale=_scale(filled["contraction"]),
        )

    @property
    def is_timed(self) -> bool:
        """Whether all runs have a time."""
        return bool(self.step.size and np.all(self.step > 0.0))

    @functools.cached_property
    def time(self) -> Array:
        """The time from the first row of each run [s]."""
        return np.asarray(self.step[:, None] * np.arange(self.modelled.shape[1]))

    @property
    def duration(self) -> float:
        """The median duration of the runs [s]."""
        return float(np.median(self.time[:, -1]))

    def rows(self, columns: Array) -> Array:
        """The known rows (N, K) of columns (R, n, K)."""
        return np.asarray(columns[self.is_known])


@dataclasses.dataclass(frozen=True, eq=False)
class _Grid:
    """The row of a recording (n,), with fractions, at each point."""

    place: Array
    step: float

    @classmethod
    def of(cls, recording: Recording, points: int) -> "_Grid":
        rows = np.arange(len(recording), dtype=float)
        untimed = cls(np.linspace(0.0, len(rows) - 1.0, points), 0.0)
        if "time" not in recording:
            return untimed
        time = recording["time"]
        is_increasing = np.isfinite(time).all() and (np.diff(time) > 0.0).all()
        if not is_increasing:
            return untimed
        even = np.linspace(time[0], time[-1], points)
        place = np.interp(even, time, rows)
        row = np.round(place)
        # a point at a row takes nothing of the next one, whose residual may be unknown
        is_at_row = np.abs(place - row) < ROW_ROUNDING
        return cls(np.where(is_at_row, row, place), float(even[1] - even[0]))

    def values(self, column: Array) -> Array:
        return np.interp(self.place, np.arange(column.size), column)


def _stacked(grids: Sequence[_Grid], columns: Sequence[Array]) -> Array:
    return np.array([grid.values(column) for grid, column in zip(grids, columns, strict=True)])


def _filled(values: Array) -> Array:
    """The values with the mean of all known ones in place of the unknown."""
    is_known = np.isfinite(values)
    mean = float(np.mean(values[is_known])) if is_known.any() else 0.0
    return np.where(is_known, values, mean)


def scaled(values: Array) -> Array:
    """The values on a scale from -1 to 1."""
    if not values.size or not np.ptp(values) > 0.0:
        return np.zeros(values.shape)
    return np.asarray(2.0 * (values - np.min(values)) / np.ptp(values) - 1.0)


def _scale(values: Array) -> float:
    """Change of `scaled` values for a change by one."""
    span = float(np.ptp(values)) if values.size else 0.0
    return 2.0 / span if span > 0.0 else 0.0


class SensorResponse(Protocol):
    """What a sensor makes of signals."""

    def __call__(self, signals: Array, times: Array) -> Array:
        """The response (R, n, K) to signals (R, n) with the times of the sensor (R, K) in rows."""

    def noise_left(self, time: float) -> float:
        """The share of the variance of white noise that is left with a time in rows."""


class Delay:
    """A delay by these times."""

    def __call__(self, signals: Array, times: Array) -> Array:
        points = np.arange(signals.shape[1])
        return _at(signals, points[None, :, None] - times[:, None, :])

    def noise_left(self, time: float) -> float:
        """Between two rows the noise of both is averaged."""
        part = time % 1.0
        return part**2 + (1.0 - part) ** 2


class LowPass:
    """A low-pass filter of first order, in equilibrium at first."""

    def __call__(self, signals: Array, times: Array) -> Array:
        points = signals.shape[1]
        count = times.shape[1]
        share = -np.expm1(-1.0 / times)
        state = np.repeat(signals[:, :1], count, axis=1)
        result = np.empty((*signals.shape, count))
        for point in range(points):
            change = signals[:, point, None] - state
            state = state + share * change
            result[:, point] = state
        return result

    def noise_left(self, time: float) -> float:
        share = -float(np.expm1(-1.0 / time))
        return share / (2.0 - share)


class Average:
    """The mean over these times before each point."""

    def __call__(self, signals: Array, times: Array) -> Array:
        points = np.arange(signals.shape[1])[None, :, None]
        return _mean_between(signals, points - times[:, None, :], points + 0.0 * times[:, None, :])

    def noise_left(self, time: float) -> float:
        """Both ends count by half a row."""
        return (time - 0.5) / time**2


class AverageAround(Average):
    """The mean over these times around each point."""

    def __call__(self, signals: Array, times: Array) -> Array:
        points = np.arange(signals.shape[1])[None, :, None]
        half = 0.5 * times[:, None, :]
        return _mean_between(signals, points - half, points + half)


def slipped(travel: Array, widths: Array) -> Array:
    """The friction of a bristle, from -1 to 1, along a travel (R, n), that slips after each of
    these widths (K,); shape (R, n, K)."""
    state = np.zeros((len(travel), widths.size))
    result = np.empty((*travel.shape, widths.size))
    moves = np.diff(travel, axis=1, prepend=travel[:, :1])
    for point in range(travel.shape[1]):
        move = moves[:, point, None]
        decay = np.exp(-np.abs(move) / widths)
        state = np.sign(move) + (state - np.sign(move)) * decay
        result[:, point] = state
    return result


def _at(signals: Array, places: Array) -> Array:
    """The signals (R, n) at places (R, n, K), constant beyond their ends."""
    last = signals.shape[1] - 1
    inside = np.clip(places, 0.0, last)
    below = inside.astype(np.intp)
    above = np.minimum(below + 1, last)
    runs = np.arange(len(signals))[:, None, None]
    low = signals[runs, below]
    rise = signals[runs, above] - low
    return np.asarray(low + (inside - below) * rise)


def _mean_between(signals: Array, low: Array, high: Array) -> Array:
    """The mean of the signals (R, n) between two places (R, n, K)."""
    return np.asarray((_integral(signals, high) - _integral(signals, low)) / (high - low))


def _integral(signals: Array, places: Array) -> Array:
    """The integral of the signals from the first point to the places (R, n, K)."""
    means = 0.5 * (signals[:, 1:] + signals[:, :-1])
    sums = np.zeros(signals.shape)
    sums[:, 1:] = np.cumsum(means, axis=1)
    last = signals.shape[1] - 1
    first_value = signals[:, :1, None]
    last_value = signals[:, -1:, None]
    rows_before = np.minimum(places, 0.0)
    rows_after = np.maximum(places - last, 0.0)
    inside = _at(sums, places)
    before = rows_before * first_value
    after = rows_after * last_value
    return np.asarray(inside + before + after)
