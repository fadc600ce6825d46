"""What is kept of each run: numbers that sum up a column, or the column itself on given instants.

Means are over time: the integral by trapezoids between the recorded rows, divided by the length of the window. A level
is reached where the straight line between two rows crosses it. So the rows of the scenario ([run] output) set how fine
these numbers are.
"""

from __future__ import annotations

import abc
import dataclasses
import math
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.errors import ParameterError
from .parse import key, quantity, ratio, seconds, word


class Window(NamedTuple):
    """A column (N,) at its instants (N,) [s]."""

    time: Array
    values: Array


@dataclasses.dataclass(frozen=True)
class Metric(abc.ABC):
    """One thing that is kept of a column of every run, between two instants [s] or over the whole run."""

    column: str = key(word, "column of the run that is looked at")
    begin: float = key(seconds, "instant from which on it is looked at", default=-math.inf, kw_only=True)
    end: float = key(seconds, "instant until which it is looked at", default=math.inf, kw_only=True)

    def __post_init__(self) -> None:
        if not self.begin < self.end:
            raise ParameterError(
                f"{type(self).__name__}: from {self.begin:g} to {self.end:g} s; its end must be later than its begin."
            )

    def window(self, time: Array, values: Array) -> Window:
        """The part of a run (N,) that is looked at; rows at the ends themselves are interpolated."""
        first, last = max(self.begin, time[0]), min(self.end, time[-1])
        if not first <= last:
            return Window(np.empty(0), np.empty(0))
        inside = (time > first) & (time < last)
        at = np.unique([first, last])
        instants = np.concatenate([at[:1], time[inside], at[1:]])
        return Window(instants, np.interp(instants, time, values))

    def check_range(self, start: float, duration: float) -> None:
        """Raise ParameterError where nothing of a run of `duration` from `start` on [s] is looked at."""
        if not max(self.begin, start) <= min(self.end, start + duration):
            raise ParameterError(
                f"{type(self).__name__}: from {self.begin:g} to {self.end:g} s there is nothing of a run from "
                f"{start:g} to {start + duration:g} s."
            )

    @property
    def times(self) -> Array:
        """Instants [s] that must be among the rows of a run."""
        return np.array([t for t in (self.begin, self.end) if math.isfinite(t)])

    @abc.abstractmethod
    def unit(self, of_column: str) -> str:
        """The outcome's unit, from the column's."""


class Scalar(Metric):
    """An outcome that is one number; NaN where the run does not have it."""

    def value(self, time: Array, values: Array) -> float:
        """The outcome of a run with this column (N,) at these instants (N,) [s]."""
        window = self.window(time, values)
        return self._evaluate(window) if window.time.size else math.nan

    @abc.abstractmethod
    def _evaluate(self, window: Window) -> float:
        """The outcome of a window that has one row at least."""

    def unit(self, of_column: str) -> str:
        return of_column


class Final(Scalar):
    """The last value."""

    def _evaluate(self, window: Window) -> float:
        return float(window.values[-1])


class Maximum(Scalar):
    """The greatest value."""

    def _evaluate(self, window: Window) -> float:
        return float(window.values.max())


class Minimum(Scalar):
    """The least value."""

    def _evaluate(self, window: Window) -> float:
        return float(window.values.min())


class Mean(Scalar):
    """The mean over time."""

    def _evaluate(self, window: Window) -> float:
        return _time_mean(window.time, window.values)


class RootMeanSquare(Scalar):
    """The root of the mean square over time."""

    def _evaluate(self, window: Window) -> float:
        # squares of a straight line are a parabola, whose integral Simpson's rule gives exactly
        a, b = window.values[:-1], window.values[1:]
        lengths = np.diff(window.time)
        if not lengths.sum() > 0:
            return abs(float(window.values[0]))
        return math.sqrt(float(lengths @ (a * a + a * b + b * b)) / 3.0 / float(lengths.sum()))


@dataclasses.dataclass(frozen=True)
class TimeToReach(Scalar):
    """Time [s] from the window's begin until the column first reaches a level, from whichever side it comes."""

    level: float = key(quantity, "value that is reached")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.isfinite(self.level):
            raise ParameterError(f"TimeToReach: level is {self.level}; it must be finite.")

    def _evaluate(self, window: Window) -> float:
        return _first_crossing(window, self.level) - float(window.time[0])

    def unit(self, of_column: str) -> str:
        return "s"


class Overshoot(Scalar):
    """How far the column goes beyond its last value, as a part of its way from the first to the last [1]."""

    def _evaluate(self, window: Window) -> float:
        way = window.values[-1] - window.values[0]
        if way == 0.0:
            return math.nan
        return max(0.0, float(((window.values - window.values[-1]) / way).max()))

    def unit(self, of_column: str) -> str:
        return "1"


@dataclasses.dataclass(frozen=True)
class SettlingTime(Scalar):
    """Time [s] from the window's begin until the column stays within a band about its last value.

    The band is a part of the way from the first to the last value, 2 % to either side unless given.
    """

    band: float = key(ratio, "half the width of the band, as a part of the way", default=0.02, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.band < 1:
            raise ParameterError(f"SettlingTime: band is {self.band:g}; it must lie between 0 and 1.")

    def _evaluate(self, window: Window) -> float:
        last, begin = window.values[-1], float(window.time[0])
        half = self.band * abs(last - window.values[0])
        outside = np.flatnonzero(np.abs(window.values - last) > half)
        if half == 0.0:
            return 0.0 if outside.size == 0 else math.nan
        if outside.size == 0:
            return 0.0
        rest = Window(window.time[outside[-1] :][:2], np.abs(window.values - last)[outside[-1] :][:2])
        return _first_crossing(rest, half) - begin

    def unit(self, of_column: str) -> str:
        return "s"


@dataclasses.dataclass(frozen=True)
class TimeSeries(Metric):
    """The whole column, on instants at equal distances; NaN where a run ended before."""

    sample_time: float = key(seconds, "distance of the instants")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.sample_time < math.inf:
            raise ParameterError(f"Course: every is {self.sample_time:g} s; it must be positive and finite.")

    def clip_to_run(self, start: float, duration: float) -> TimeSeries:
        """The same with its window cut to a run, so that its instants are fixed. Raises ParameterError."""
        begin, end = max(self.begin, start), min(self.end, start + duration)
        if not begin < end or (end - begin) / self.sample_time > 1_000_000:
            raise ParameterError(
                f"Course: from {begin:g} to {end:g} s every {self.sample_time:g} s; 2 to 1000000 instants must lie within "
                "the run."
            )
        return dataclasses.replace(self, begin=begin, end=end)

    @property
    def times(self) -> Array:
        steps = math.floor((self.end - self.begin) / self.sample_time * (1 + 1e-12))
        return np.asarray(self.begin + self.sample_time * np.arange(steps + 1), dtype=float)

    def unit(self, of_column: str) -> str:
        return of_column

    def sample(self, time: Array, values: Array) -> Array:
        """The column at the instants, from a run whose rows hold them."""
        slack = 1e-9 * (self.end - self.begin)
        found = np.interp(self.times, time, values)
        return np.where((self.times >= time[0] - slack) & (self.times <= time[-1] + slack), found, np.nan)


METRICS = (
    Final, Maximum, Minimum, Mean, RootMeanSquare, TimeToReach, Overshoot, SettlingTime, TimeSeries,
)  # fmt: skip


def _time_mean(time: Array, values: Array) -> float:
    length = float(time[-1] - time[0])
    return float(np.trapezoid(values, time)) / length if length > 0 else float(values[0])


def _first_crossing(window: Window, level: float) -> float:
    """The instant at which the lines between the rows first meet a level; NaN where they do not."""
    away = window.values - level
    met = np.flatnonzero(np.append(away[:-1] * away[1:] < 0.0, False) | (away == 0.0))
    if met.size == 0:
        return math.nan
    i = met[0]
    if away[i] == 0.0:
        return float(window.time[i])
    part = away[i] / (away[i] - away[i + 1])
    return float(window.time[i] + part * (window.time[i + 1] - window.time[i]))
