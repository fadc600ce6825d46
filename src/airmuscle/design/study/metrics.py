"""Metrics stored for each run: scalar values of a column, and time series.

Means are over time: the integral (trapezoidal rule) between the recorded rows, divided by the
duration of the window. A level is reached where the straight line between two rows crosses it. The
output step of the scenario ([run] output) therefore determines the accuracy of the metrics.
"""

import abc
import dataclasses
import math
from typing import Any, ClassVar, Self

import numpy as np

from ...core import Array, ParameterError
from ...files.library import custom_field, read_finite_number
from ...files.scenario.values import Number
from .paths import read_name


@dataclasses.dataclass(frozen=True)
class Metric:
    """A metric of one column of each run, within a time window [s] or over the whole run."""

    own_unit: ClassVar[str] = ""
    """The unit of a metric that does not have the unit of its column."""
    column: str = custom_field(read_name, "column of the run")
    begin: float = custom_field(
        Number("s"), "start of the time window", default=-math.inf, kw_only=True
    )
    end: float = custom_field(Number("s"), "end of the time window", default=math.inf, kw_only=True)

    def __post_init__(self) -> None:
        if not self.begin < self.end:
            raise ParameterError(
                f"{type(self).__name__}: the window is {self.begin:g} to {self.end:g} s; its end"
                " must be later than its begin."
            )

    def window(self, time: Array, values: Array) -> tuple[Array, Array]:
        """Times [s] and values of a run (N,) within the time window; values at its bounds are
        interpolated.
        """
        first = max(self.begin, time[0])
        last = min(self.end, time[-1])
        if not first <= last:
            return np.empty(0), np.empty(0)
        bounds = np.unique([first, last])
        times = np.concatenate([bounds[:1], time[(time > first) & (time < last)], bounds[1:]])
        return times, np.interp(times, time, values)

    def clip_to_run(self, start: float, duration: float) -> Self:
        """The metric in a run of `duration` [s] from `start` [s]. Raises ParameterError if its
        window is outside.
        """
        if not max(self.begin, start) <= min(self.end, start + duration):
            raise ParameterError(
                f"{type(self).__name__}: the window {self.begin:g} to {self.end:g} s does not"
                f" overlap the run, {start:g} to {start + duration:g} s."
            )
        return self

    @property
    def times(self) -> Array:
        """The times [s] that must be among the rows of a run."""
        return np.array([t for t in (self.begin, self.end) if math.isfinite(t)])

    def unit(self, column_unit: str) -> str:
        """The unit of the metric, given that of the column."""
        return self.own_unit or column_unit


class Scalar(Metric, abc.ABC):
    """A metric that is a single number; NaN if it does not exist for a run."""

    def value(self, time: Array, values: Array) -> float:
        """The metric of a run with times (N,) [s] and values (N,) of the column."""
        times, inside = self.window(time, values)
        return self._evaluate(times, inside) if times.size else math.nan

    @abc.abstractmethod
    def _evaluate(self, time: Array, values: Array) -> float:
        """The metric of a window with at least one row."""


class Final(Scalar):
    """Final value."""

    def _evaluate(self, time: Array, values: Array) -> float:
        return float(values[-1])


class Maximum(Scalar):
    """Maximum value."""

    def _evaluate(self, time: Array, values: Array) -> float:
        return float(values.max())


class Minimum(Scalar):
    """Minimum value."""

    def _evaluate(self, time: Array, values: Array) -> float:
        return float(values.min())


class Mean(Scalar):
    """Mean over time."""

    def _evaluate(self, time: Array, values: Array) -> float:
        return time_mean(time, values)


class RootMeanSquare(Scalar):
    """Root mean square over time."""

    def _evaluate(self, time: Array, values: Array) -> float:
        # the square of a linear function is a parabola, which Simpson's rule integrates exactly
        a = values[:-1]
        b = values[1:]
        steps = np.diff(time)
        if not steps.sum() > 0:
            return abs(float(values[0]))
        integral = float(steps @ (a * a + a * b + b * b)) / 3.0
        return math.sqrt(integral / float(steps.sum()))


@dataclasses.dataclass(frozen=True)
class TimeToReach(Scalar):
    """Time [s] from the start of the window until the column first reaches a level, from above or
    below.
    """

    own_unit: ClassVar[str] = "s"
    level: float = custom_field(read_finite_number, "value to be reached")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.isfinite(self.level):
            raise ParameterError(f"TimeToReach: level is {self.level}; it must be finite.")

    def _evaluate(self, time: Array, values: Array) -> float:
        return _first_crossing(time, values, self.level) - float(time[0])


class Overshoot(Scalar):
    """Overshoot beyond the final value, as a fraction of the difference between final and initial
    value [1].
    """

    own_unit: ClassVar[str] = "1"

    def _evaluate(self, time: Array, values: Array) -> float:
        change = values[-1] - values[0]
        return (
            max(0.0, float(((values - values[-1]) / change).max())) if change != 0.0 else math.nan
        )


@dataclasses.dataclass(frozen=True)
class SettlingTime(Scalar):
    """Time [s] from the start of the window until the column remains within a band around its final
    value.

    Half the width of the band is the fraction `band` of the difference between final and initial
    value, by default 2 %.
    """

    own_unit: ClassVar[str] = "s"
    band: float = custom_field(
        Number("1"),
        "half-width of the band, relative to the change of the column",
        default=0.02,
        kw_only=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.band < 1:
            raise ParameterError(
                f"SettlingTime: band is {self.band:g}; it must be between 0 and 1."
            )

    def _evaluate(self, time: Array, values: Array) -> float:
        error = values - values[-1]
        begin = float(time[0])
        half_width = self.band * abs(float(error[0]))
        outside = np.flatnonzero(np.abs(error) > half_width)
        if outside.size == 0:
            return 0.0
        if half_width == 0.0:
            return math.nan
        i = int(outside[-1])
        return (
            _first_crossing(time[i : i + 2], error[i : i + 2], math.copysign(half_width, error[i]))
            - begin
        )


@dataclasses.dataclass(frozen=True)
class TimeSeries(Metric):
    """The column at equidistant times; NaN after the end of a run that was aborted."""

    sample_time: float = custom_field(Number("s"), "sample time")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.sample_time < math.inf:
            raise ParameterError(
                f"TimeSeries: sample_time is {self.sample_time:g} s; it must be positive and"
                " finite."
            )

    def clip_to_run(self, start: float, duration: float) -> Self:
        """The time series whose window is clipped to a run, which fixes its times. Raises
        ParameterError.
        """
        super().clip_to_run(start, duration)
        begin = max(self.begin, start)
        end = min(self.end, start + duration)
        if not begin < end or (end - begin) / self.sample_time > 1_000_000:
            raise ParameterError(
                f"TimeSeries: {begin:g} to {end:g} s with a sample time of {self.sample_time:g} s;"
                " 2 to 1000000 samples must lie within the run."
            )
        return dataclasses.replace(self, begin=begin, end=end)

    @property
    def times(self) -> Array:
        steps = math.floor((self.end - self.begin) / self.sample_time * (1 + 1e-12))
        return np.asarray(self.begin + self.sample_time * np.arange(steps + 1), dtype=float)

    def sample(self, time: Array, values: Array) -> Array:
        """The column (T,) at `times`, from a run with times (N,) [s] and values (N,)."""
        tolerance = 1e-9 * (self.end - self.begin)
        samples = np.interp(self.times, time, values)
        return np.where(
            (self.times >= time[0] - tolerance) & (self.times <= time[-1] + tolerance),
            samples,
            np.nan,
        )


METRICS: dict[str, type[Any]] = {
    cls.__name__: cls
    for cls in (
        Final,
        Maximum,
        Minimum,
        Mean,
        RootMeanSquare,
        TimeToReach,
        Overshoot,
        SettlingTime,
        TimeSeries,
    )
}
"""The metrics that a study file may name."""


def time_mean(time: Array, values: Array) -> float:
    """The mean over time of values (N,) at times (N,), by the trapezoidal rule."""
    duration = float(time[-1] - time[0])
    return float(np.trapezoid(values, time)) / duration if duration > 0 else float(values[0])


def _first_crossing(time: Array, values: Array, level: float) -> float:
    """The time at which the lines between the rows first cross a level; NaN if they do not."""
    distance = values - level
    crossings = np.flatnonzero(
        np.append(distance[:-1] * distance[1:] < 0.0, False) | (distance == 0.0)
    )
    if crossings.size == 0:
        return math.nan
    i = crossings[0]
    if distance[i] == 0.0:
        return float(time[i])
    fraction = distance[i] / (distance[i] - distance[i + 1])
    return float(time[i] + fraction * (time[i + 1] - time[i]))
