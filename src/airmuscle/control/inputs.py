"""Commands in time: what opens valves and latches. Between two instants every input is linear in time."""

from __future__ import annotations

import abc
import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..core.arrays import Array
from ..core.declaration import as_float
from ..core.errors import ParameterError, suggestion

if TYPE_CHECKING:
    from ..recording import Recording

MOST_INSTANTS = 10_000_000
"""Instants of one command that fit a usual memory."""
COARSEST, MOST_POINTS = 64, 100_000
"""Lines that a function is followed by at first, and points at most."""


@dataclasses.dataclass(frozen=True, eq=False)
class PiecewiseLinear:
    """A command cut at its instants: ends (S,), inputs at each start (S, m), and their slopes [1/s] (S, m)."""

    ends: Array
    values: Array
    slopes: Array

    def inputs_at(self, times: Array, start: float) -> Array:
        """The inputs (N, m) at times (N,); at an instant those that begin there."""
        starts = self.starts(start)
        index = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
        return np.asarray(self.values[index] + (times - starts[index])[:, None] * self.slopes[index])

    def starts(self, start: float) -> Array:
        """Where each segment begins (S,)."""
        return np.concatenate([[start], self.ends[:-1]])

    def check_shape(self, inputs: int, start: float) -> None:
        """Raise ParameterError unless ends rise from `start` [s] and every segment has all inputs, all finite.

        A kernel reads what it is told is there, so this stands before it.
        """
        ends, values, slopes = (np.asarray(a, dtype=float) for a in (self.ends, self.values, self.slopes))
        shape = (ends.size, inputs)
        if ends.ndim != 1 or not ends.size or values.shape != shape or slopes.shape != shape:
            raise ParameterError(
                f"segments have ends {ends.shape}, values {values.shape} and slopes {slopes.shape}; for {inputs} "
                f"inputs they must be (S,), (S, {inputs}) and (S, {inputs}), with one segment at least."
            )
        if not (np.isfinite(ends).all() and np.isfinite(values).all() and np.isfinite(slopes).all()):
            raise ParameterError("segments hold a number that is not finite.")
        if not (np.diff(ends, prepend=start) > 0).all():
            raise ParameterError(f"segments must end in rising order after {start:g} s; they end at {ends.tolist()} s.")

    def cut_at(self, starts: Array, start: float) -> PiecewiseLinear:
        """The same course with segments that begin at other instants (R,), in rising order, the first not before
        `start`; within them it must have no instant of its own."""
        index = np.maximum(np.searchsorted(self.starts(start), starts, side="right") - 1, 0)
        ends = np.append(starts[1:], self.ends[-1])
        return PiecewiseLinear(ends, self.inputs_at(starts, start), self.slopes[index])


class InputSignal(abc.ABC):
    """What the inputs of a plant do in time."""

    @abc.abstractmethod
    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        """The command for these inputs from `start` on, cut so that every input is linear within a segment."""

    @property
    def names(self) -> tuple[str, ...] | None:
        """The inputs that it speaks of; None where it does not say."""
        return None


def check_input_signal(given: object) -> None:
    """Raise ParameterError for what is no Command, as a dictionary is."""
    if not isinstance(given, InputSignal):
        raise ParameterError(f"the command is {given!r}; give a Schedule, a Signal or another Command.")


NO_INPUT = "the plant has no input"


def check_input_names(given: Sequence[str], inputs: Sequence[str], lacks: str = NO_INPUT) -> None:
    """Raise ParameterError, with the nearest name, for a name that is no input of the plant."""
    for name in given:
        if name not in inputs:
            known = ", ".join(inputs) or "none"
            raise ParameterError(f"{lacks} '{name}'; there are {known}.{suggestion(name, inputs)}")


def _check_mapping(kind: str, given: object, example: str = "((5, 1), (15, 0))") -> None:
    if not isinstance(given, Mapping):
        raise ParameterError(f"a {kind} is {given!r}; name the inputs: {{'fill': {example}}}.")


def _pairs(kind: str, name: str, given: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    try:
        return [(as_float("a time", time), as_float("a value", value)) for time, value in given]
    except (TypeError, ValueError, ParameterError):
        raise ParameterError(
            f"the {kind} of '{name}' is {given!r}; write pairs of time [s] and value, ((5, 1), (15, 0))."
        ) from None


def _check_order(kind: str, word: str, name: str, times: Sequence[float]) -> None:
    if any(b <= a for a, b in itertools.pairwise(times)):
        raise ParameterError(f"the {kind} of '{name}' must name its {word} in rising order; it has {times}.")


@dataclasses.dataclass(frozen=True)
class Schedule(InputSignal):
    """Piecewise constant inputs, each a sequence of (instant [s], value from then on); before the first it is 0.

    `Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)})`
    """

    from_file: ClassVar[bool] = True

    changes: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        _check_mapping("schedule", self.changes)
        for name, given in self.changes.items():
            changes = _pairs("schedule", name, given)
            if changes and not np.isfinite(changes).all():
                raise ParameterError(f"the schedule of '{name}' holds a number that is not finite: {changes}.")
            _check_order("schedule", "instants", name, [time for time, _ in changes])

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.changes)

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        check_input_names(list(self.changes), inputs)
        end = start + duration
        instants = {time for changes in self.changes.values() for time, _ in changes if start < time < end}
        starts = np.array([start, *sorted(instants)])
        values = np.zeros((starts.size, len(inputs)))
        for i, name in enumerate(inputs):
            times, levels = np.array([(-np.inf, 0.0), *self.changes.get(name, ())], dtype=float).T
            values[:, i] = levels[np.searchsorted(times, starts, side="right") - 1]
        return PiecewiseLinear(np.append(starts[1:], end), values, np.zeros_like(values))


@dataclasses.dataclass(frozen=True)
class SampledSignal(InputSignal):
    """Piecewise linear inputs, each a sequence of (time [s], value); constant before the first and after the last."""

    from_file: ClassVar[bool] = True

    points: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        _check_mapping("signal", self.points)
        for name, given in self.points.items():
            points = _pairs("signal", name, given)
            if not points or not np.isfinite(points).all():
                raise ParameterError(f"the signal of '{name}' must be finite points (time, value); it is {points}.")
            _check_order("signal", "times", name, [time for time, _ in points])

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.points)

    @classmethod
    def recorded(cls, recording: Recording, columns: Mapping[str, str]) -> SampledSignal:
        """What was measured, as a command: for each input the column of the recording that it follows.

        `Signal.recorded(read_csv("bench.csv"), {"fill": "fill"})`; the values are those of the recording, in SI.
        """
        from ..recording import Recording

        if not isinstance(recording, Recording):
            raise ParameterError(f"Signal.recorded: {recording!r} is no Recording; give what read_csv or read returns.")
        _check_mapping("recorded signal", columns, "'column'")
        times = recording["time"].tolist()
        return cls({name: tuple(zip(times, recording[c].tolist(), strict=True)) for name, c in columns.items()})

    @classmethod
    def sampled(
        cls, functions: Mapping[str, Callable[[float], float]], *, duration: float, start: float = 0.0,
        error: float = 1e-4,
    ) -> SampledSignal:  # fmt: skip
        """Functions of time [s], followed to within `error` by straight lines that are halved until they do.

        Each line is held against its function at a quarter, a half and three quarters of it, and none is longer than
        1/64 of the duration (chosen); what a function does between those points is not seen. Raises ParameterError for
        a function that 100 000 points do not follow, for one that jumps (give that one as a Schedule), and for one that
        does not return a finite number.
        """
        _check_mapping("sampled signal", functions, "lambda t: 0.5")
        duration, start = as_float("Signal.sampled: duration", duration), as_float("Signal.sampled: start", start)
        error = as_float("Signal.sampled: error", error)
        return cls({name: _followed(name, f, start, start + duration, error) for name, f in functions.items()})

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        check_input_names(list(self.points), inputs)
        end = start + duration
        corners = {time for points in self.points.values() for time, _ in points if start < time < end}
        ends = np.array([*sorted(corners), end])
        edges = np.concatenate([[start], ends])
        values = np.zeros((edges.size, len(inputs)))
        for i, name in enumerate(inputs):
            if name in self.points:
                times, levels = np.array(self.points[name], dtype=float).T
                values[:, i] = np.interp(edges, times, levels)
        return PiecewiseLinear(ends, values[:-1], np.diff(values, axis=0) / np.diff(edges)[:, None])


def _followed(
    name: str, function: Callable[[float], float], start: float, end: float, error: float
) -> tuple[tuple[float, float], ...]:
    """Points on a function whose connecting lines stay within `error` of it."""
    if not (0 < error < np.inf and -np.inf < start < end < np.inf):
        raise ParameterError(
            f"the signal of '{name}': from {start!r} to {end!r} s within {error!r}; an error above 0 is needed, and a "
            "duration above 0."
        )
    times = np.linspace(start, end, COARSEST + 1)
    values = _values(name, function, times)
    while True:
        lengths = np.diff(times)
        between = times[:-1] + np.array([[0.25], [0.5], [0.75]]) * lengths
        found = _values(name, function, between.ravel()).reshape(between.shape)
        away = np.abs(found - np.interp(between, times, values)).max(axis=0)
        at = np.flatnonzero(away > error)
        if at.size == 0:
            return tuple(zip(times.tolist(), values.tolist(), strict=True))
        if times.size + at.size > MOST_POINTS or lengths[at].min() < 1e-9 * (end - start):
            raise ParameterError(
                f"the signal of '{name}' is not followed to {error:g} by {times.size} points: it differs by "
                f"{away.max():g} at {times[np.argmax(away)]:g} s. Allow a larger error; give what jumps as a Schedule."
            )
        times, values = np.insert(times, at + 1, between[1, at]), np.insert(values, at + 1, found[1, at])


def _values(name: str, function: Callable[[float], float], times: Array) -> Array:
    """A function of time at times (N,). Raises ParameterError where it gives no finite number."""
    if not callable(function):
        raise ParameterError(f"the signal of '{name}' is {function!r}; give a function of time [s].")
    values = np.empty(times.size)
    for i, time in enumerate(times.tolist()):
        values[i] = as_float(f"the signal of '{name}' at {time:g} s", function(time))
        if not np.isfinite(values[i]):
            raise ParameterError(f"the signal of '{name}' is {values[i]} at {time:g} s; it must be finite.")
    return values


@dataclasses.dataclass(frozen=True)
class Periodic(InputSignal):
    """The first `period` [s] of another command, from its time 0 on, over and over, before time 0 too.

    Drivers go around it, `WithDrivers(Periodic(...), ...)`: inside it they would begin anew with every period.
    """

    inner: InputSignal
    period: float

    def __post_init__(self) -> None:
        check_input_signal(self.inner)
        if not 0 < as_float("Periodic.period", self.period) < np.inf:
            raise ParameterError(f"Periodic.period is {self.period!r} s; it must be positive and finite.")

    @property
    def names(self) -> tuple[str, ...] | None:
        return self.inner.names

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        once, end = self.inner.segments(inputs, 0.0, self.period), start + duration
        first, last = np.floor(start / self.period), np.ceil(end / self.period)
        if (last - first) * once.ends.size > MOST_INSTANTS:
            raise ParameterError(
                f"a command of {once.ends.size} pieces every {self.period:g} s makes more than {MOST_INSTANTS} "
                f"instants in {duration:g} s. Simulate a shorter time."
            )
        begins, size = self.period * np.arange(first, last), (int(last - first), 1)
        starts = (begins[:, None] + once.starts(0.0)).ravel()
        rounding = 4 * np.spacing(max(abs(start), self.period))
        starts[np.abs(starts - start) <= rounding] = start  # 3 * 0.1 is more than 0.3: no piece of 1e-17 s
        whole = PiecewiseLinear(np.append(starts[1:], end), np.tile(once.values, size), np.tile(once.slopes, size))
        within = starts[(starts > start) & (starts < end)]
        return whole.cut_at(np.append(start, within), float(starts[0]))


ZERO_INPUT = Schedule({})
"""Every input stays at zero: valves shut, latch open."""
