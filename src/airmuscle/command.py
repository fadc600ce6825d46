"""Commands in time: what opens valves and latches. Between two instants every input is linear in time."""

from __future__ import annotations

import abc
import dataclasses
import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from .errors import ParameterError, suggestion

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Segments:
    """A command cut at its instants: ends (S,), inputs at each start (S, m), and their slopes [1/s] (S, m)."""

    ends: Array
    values: Array
    slopes: Array

    def inputs_at(self, times: Array, start: float) -> Array:
        """The inputs (N, m) at times (N,); at an instant those that begin there."""
        starts = self.starts(start)
        index = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, self.ends.size - 1)
        return np.asarray(self.values[index] + (times - starts[index])[:, None] * self.slopes[index])

    def starts(self, start: float) -> Array:
        """Where each segment begins (S,)."""
        return np.concatenate([[start], self.ends[:-1]])

    def cut_at(self, starts: Array, start: float) -> Segments:
        """The same course with segments that begin at other instants (R,), in rising order, the first not before
        `start`; within them it must have no instant of its own."""
        index = np.searchsorted(self.starts(start), starts, side="right") - 1
        ends = np.append(starts[1:], self.ends[-1])
        return Segments(ends, self.inputs_at(starts, start), self.slopes[index])


class Command(abc.ABC):
    """What the inputs of a plant do in time."""

    @abc.abstractmethod
    def segments(self, inputs: Sequence[str], start: float, duration: float) -> Segments:
        """The command for these inputs from `start` on, cut so that every input is linear within a segment."""


def refuse_unknown_input(given: Sequence[str], inputs: Sequence[str]) -> None:
    """Raise ParameterError, with the nearest name, for a name that is no input of the plant."""
    for name in given:
        if name not in inputs:
            known = ", ".join(inputs) or "none"
            raise ParameterError(f"the plant has no input '{name}'; there are {known}.{suggestion(name, inputs)}")


def _pairs(kind: str, name: str, given: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    try:
        return [(0.0 + time, 0.0 + value) for time, value in given]
    except (TypeError, ValueError):
        raise ParameterError(
            f"the {kind} of '{name}' is {given!r}; write pairs of time [s] and value, ((5, 1), (15, 0))."
        ) from None


def _refuse_disorder(kind: str, word: str, name: str, times: Sequence[float]) -> None:
    if any(b <= a for a, b in itertools.pairwise(times)):
        raise ParameterError(f"the {kind} of '{name}' must name its {word} in rising order; it has {times}.")


@dataclasses.dataclass(frozen=True)
class Schedule(Command):
    """Piecewise constant inputs, each a sequence of (instant [s], value from then on); before the first it is 0.

    `Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)})`
    """

    changes: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        for name, given in self.changes.items():
            changes = _pairs("schedule", name, given)
            if changes and not np.isfinite(changes).all():
                raise ParameterError(f"the schedule of '{name}' holds a number that is not finite: {changes}.")
            _refuse_disorder("schedule", "instants", name, [time for time, _ in changes])

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> Segments:
        refuse_unknown_input(list(self.changes), inputs)
        end = start + duration
        instants = {time for changes in self.changes.values() for time, _ in changes if start < time < end}
        starts = np.array([start, *sorted(instants)])
        values = np.zeros((starts.size, len(inputs)))
        for i, name in enumerate(inputs):
            times, levels = np.array([(-np.inf, 0.0), *self.changes.get(name, ())], dtype=float).T
            values[:, i] = levels[np.searchsorted(times, starts, side="right") - 1]
        return Segments(np.append(starts[1:], end), values, np.zeros_like(values))


@dataclasses.dataclass(frozen=True)
class Signal(Command):
    """Piecewise linear inputs, each a sequence of (time [s], value); constant before the first and after the last."""

    points: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        for name, given in self.points.items():
            points = _pairs("signal", name, given)
            if not points or not np.isfinite(points).all():
                raise ParameterError(f"the signal of '{name}' must be finite points (time, value); it is {points}.")
            _refuse_disorder("signal", "times", name, [time for time, _ in points])

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> Segments:
        refuse_unknown_input(list(self.points), inputs)
        end = start + duration
        corners = {time for points in self.points.values() for time, _ in points if start < time < end}
        ends = np.array([*sorted(corners), end])
        edges = np.concatenate([[start], ends])
        values = np.zeros((edges.size, len(inputs)))
        for i, name in enumerate(inputs):
            if name in self.points:
                times, levels = np.array(self.points[name], dtype=float).T
                values[:, i] = np.interp(edges, times, levels)
        return Segments(ends, values[:-1], np.diff(values, axis=0) / np.diff(edges)[:, None])


REST = Schedule({})
"""Every input stays at zero: valves shut, latch open."""
