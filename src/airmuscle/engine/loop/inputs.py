"""Input signals: inputs of a plant as functions of time, linear between two instants."""

from __future__ import annotations

import abc
import bisect
import dataclasses
import itertools
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import ClassVar

import numpy as np

from ...core.annotation import abridged, one_line
from ...core.declaration import as_float
from ...core.errors import AirmuscleWarning, ParameterError, suggestion
from ...recording.recording import Recording
from .approximation import approximate
from .piecewise_linear import PiecewiseLinear

MAX_INSTANTS = 10_000_000
"""Instants of one run that fit a usual memory."""


class InputSignal(abc.ABC):
    """The inputs of a plant as functions of time."""

    @abc.abstractmethod
    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        """These inputs from `start` [s] on, split so that every input is linear within a segment.

        Raises ParameterError for an input that the plant does not have.
        """

    def checked_segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        """The same as arrays that a kernel can read. Raises ParameterError also for segments that do not rise in time,
        lack an input or hold a number that is not finite."""
        segments = self.segments(inputs, start, duration)
        segments.check_shape(len(inputs), start)
        return segments.as_floats()

    @property
    def names(self) -> tuple[str, ...] | None:
        """The inputs that the signal names; None if it names none."""
        return None


def check_input_signal(given: object) -> None:
    """Raise ParameterError for anything that is not an InputSignal, such as a dictionary."""
    if not isinstance(given, InputSignal):
        remedy = ""
        if isinstance(given, Mapping) and given:
            remedy = f" Schedule({{{next(iter(given))!r}: ((0, 1.0),)}}) is an input of 1 from 0 s on."
        raise ParameterError(
            f"the input is {abridged(given)}; give a Schedule, a SampledSignal or another InputSignal.{remedy}"
        )


NO_INPUT = "the plant has no input"


def check_input_names(given: Iterable[str], inputs: Sequence[str], prefix: str = NO_INPUT) -> None:
    """Raise ParameterError, with the nearest name, for a name that is no input of the plant."""
    for name in given:
        if name not in inputs:
            known = ", ".join(inputs) or "none"
            raise ParameterError(f"{prefix} '{name}'; there are {known}.{suggestion(name, inputs)}")


def _check_mapping(kind: str, given: object, example: str = "((5, 1), (15, 0))") -> None:
    if not isinstance(given, Mapping):
        raise ParameterError(f"a {kind} is {abridged(given)}; name the inputs: {{'fill': {example}}}.")


def _pairs(kind: str, name: str, given: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    try:
        return [(as_float("a time", time), as_float("a value", value)) for time, value in given]
    except (TypeError, ValueError, ParameterError):
        raise ParameterError(
            f"the {kind} of '{name}' is {one_line(given)}; write pairs of time [s] and value, ((5, 1), (15, 0))."
        ) from None


def _check_points(kind: str, noun: str, name: str, points: Sequence[tuple[float, float]]) -> None:
    """Raise ParameterError unless all numbers are finite and times rise."""
    if points and not np.isfinite(points).all():
        raise ParameterError(f"the {kind} of '{name}' holds a number that is not finite: {one_line(points)}.")
    for i, (a, b) in enumerate(itertools.pairwise(time for time, _ in points)):
        if b <= a:
            raise ParameterError(
                f"the {kind} of '{name}' must list its {noun} in rising order; number {i + 2}, {b:g} s, follows "
                f"{a:g} s."
            )


@dataclasses.dataclass(frozen=True)
class Schedule(InputSignal):
    """Piecewise constant inputs, each a sequence of (instant [s], value from then on); 0 before the first instant.

    `Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)})`
    """

    from_file: ClassVar[bool] = True

    changes: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        _check_mapping("schedule", self.changes)
        changes = {}
        for name, given in self.changes.items():
            pairs = _pairs("schedule", name, given)
            _check_points("schedule", "instants", name, pairs)
            changes[name] = [t for t, _ in pairs], [0.0, *(v for _, v in pairs)]
        object.__setattr__(self, "_changes", changes)
        object.__setattr__(self, "_last", ((), 0.0, 0.0, None))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.changes)

    def checked_segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        """As of any signal, in arrays that cannot be written to; those of the last call are kept for the next one."""
        *asked, segments = self._last  # type: ignore[attr-defined]
        if segments is None or asked != [inputs, start, duration]:
            segments = super().checked_segments(inputs, start, duration).read_only()
            object.__setattr__(self, "_last", (inputs, start, duration, segments))
        return segments  # type: ignore[no-any-return]

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        changes: dict[str, tuple[list[float], list[float]]] = self._changes  # type: ignore[attr-defined]
        check_input_names(changes, inputs)
        end = start + duration
        starts = [start, *sorted({t for times, _ in changes.values() for t in times if start < t < end})]
        values = np.zeros((len(starts), len(inputs)))
        for i, name in enumerate(inputs):
            if name in changes:
                times, levels = changes[name]
                values[:, i] = [levels[bisect.bisect_right(times, t)] for t in starts]
        return PiecewiseLinear(np.array([*starts[1:], end]), values, np.zeros(values.shape))


@dataclasses.dataclass(frozen=True)
class SampledSignal(InputSignal):
    """Piecewise linear inputs, each a sequence of (time [s], value); constant before the first and after the last."""

    from_file: ClassVar[bool] = True

    points: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        _check_mapping("sampled signal", self.points)
        for name, given in self.points.items():
            points = _pairs("sampled signal", name, given)
            if not points:
                raise ParameterError(
                    f"the sampled signal of '{name}' has no points; write pairs of time [s] and value."
                )
            _check_points("sampled signal", "times", name, points)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.points)

    @classmethod
    def recorded(cls, recording: Recording, columns: Mapping[str, str]) -> SampledSignal:
        """Columns of a recording as inputs: for each input the column that it follows, in SI.

        `SampledSignal.recorded(read_csv("bench.csv"), {"fill": "fill"})`
        """
        if not isinstance(recording, Recording):
            raise ParameterError(
                f"SampledSignal.recorded: {one_line(recording)} is no Recording; give what read_csv or read returns."
            )
        _check_mapping("recorded signal", columns, "'column'")
        times = recording["time"].tolist()
        return cls({name: tuple(zip(times, recording[c].tolist(), strict=True)) for name, c in columns.items()})

    @classmethod
    def sampled(
        cls, functions: Mapping[str, Callable[[float], float]], *, duration: float, start: float = 0.0,
        error: float = 1e-4,
    ) -> SampledSignal:  # fmt: skip
        """Functions of time [s], approximated to within `error` by straight lines that are bisected until they are.

        Each line is compared with its function at a quarter, a half and three quarters of it, and none is longer than
        1/64 of the duration (chosen); what a function does between these points is not seen. Raises ParameterError for
        a function that 100 000 points do not approximate, for one that jumps (give it as a Schedule), and for one that
        does not return a finite number.
        """
        _check_mapping("sampled signal", functions, "lambda t: 0.5")
        duration = as_float("SampledSignal.sampled: duration", duration)
        start = as_float("SampledSignal.sampled: start", start)
        error = as_float("SampledSignal.sampled: error", error)
        return cls({name: approximate(name, f, start, start + duration, error) for name, f in functions.items()})

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        check_input_names(list(self.points), inputs)
        end = start + duration
        corners = {float(time) for points in self.points.values() for time, _ in points if start < time < end}
        ends = np.array([*sorted(corners), end])
        edges = np.concatenate([[start], ends])
        values = np.zeros((edges.size, len(inputs)))
        for i, name in enumerate(inputs):
            if name in self.points:
                times, levels = np.array(self.points[name], dtype=float).T
                values[:, i] = np.interp(edges, times, levels)
        return PiecewiseLinear(ends, values[:-1], np.diff(values, axis=0) / np.diff(edges)[:, None])

    def checked_segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        """As of any signal; an AirmuscleWarning for an input that varies after the end of the run only."""
        for name, points in self.points.items():
            first, end = points[0][0], start + duration
            if first > end and any(value != points[0][1] for _, value in points):
                warnings.warn(
                    f"the points of the input '{name}' begin at {first:.6g} s, after the end of the run at {end:.6g} "
                    "s: its first value is held. If its times have another zero, subtract it, or set start_time.",
                    AirmuscleWarning,
                    stacklevel=7,
                )
        return super().checked_segments(inputs, start, duration)


@dataclasses.dataclass(frozen=True)
class Periodic(InputSignal):
    """The first `period` [s] of another input signal, from its time 0 on, repeated for all times.

    Drivers are wrapped around it, `WithDrivers(Periodic(...), ...)`: inside they would start anew in every period.
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
        if (last - first) * once.ends.size > MAX_INSTANTS:
            raise ParameterError(
                f"an input of {once.ends.size} segments every {self.period:g} s makes more than {MAX_INSTANTS} "
                f"instants in {duration:g} s. Simulate a shorter time."
            )
        begins, size = self.period * np.arange(first, last), (int(last - first), 1)
        starts = (begins[:, None] + once.starts(0.0)).ravel()
        rounding = 4 * np.spacing(max(abs(start), self.period))
        starts[np.abs(starts - start) <= rounding] = start  # 3 * 0.1 is more than 0.3: no segment of 1e-17 s
        whole = PiecewiseLinear(np.append(starts[1:], end), np.tile(once.values, size), np.tile(once.slopes, size))
        within = starts[(starts > start) & (starts < end)]
        return whole.split_at(np.append(start, within), float(starts[0]))


ZERO_INPUT = Schedule({})
"""Every input is zero: valves closed, latch open."""
