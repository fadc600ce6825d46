"""Input signals: inputs of a plant as functions of time, linear between two instants, and their
segments in a run.
"""

import abc
import bisect
import dataclasses
import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

import numpy as np

from ...core import (
    Array,
    ParameterError,
    ShortRepr,
    abridged,
    all_finite,
    as_float,
    check_known,
    one_line,
)
from ...core.declaration import forwarded

FEW_SEGMENTS = 16
"""Segments up to which they are gone through one by one, which is faster (measured)."""
Segment = tuple[float, float, float]
"""A segment of a single input: its end [s], the value at its start, the slope [1/s]."""
MAX_INSTANTS = 10_000_000
"""Instants of one run that fit a usual memory."""
NO_INPUT = "the plant has no input"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PiecewiseLinear(ShortRepr):
    """Inputs in time: ends (S,) of the segments, inputs at the start of each (S, m), and their
    slopes [1/s] (S, m).
    """

    ends: Array
    values: Array
    slopes: Array

    def inputs_at(self, times: Array, start: float) -> Array:
        """The inputs (N, m) at times (N,); where two segments meet, those of the later one."""
        starts = self.starts(start)
        index = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
        return np.asarray(
            self.values[index] + (times - starts[index])[:, None] * self.slopes[index]
        )

    def at_rising(self, times: Array, start: float) -> tuple[Array, Array]:
        """The inputs (N, m) and their slopes (N, m) at rising times (N,), as `inputs_at` at any
        times.
        """
        if self.ends.size > FEW_SEGMENTS:
            index = np.maximum(np.searchsorted(self.starts(start), times, side="right") - 1, 0)
            return self.inputs_at(times, start), self.slopes[index]
        shape = (times.size, self.values.shape[1])
        values = np.empty(shape)
        slopes = np.empty(shape)
        begins = self.starts(start)
        first_rows = times.searchsorted(begins[1:]).tolist()
        for i, (first, last) in enumerate(itertools.pairwise([0, *first_rows, times.size])):
            rows = slice(first, last)
            slope = self.slopes[i]
            slopes[rows] = slope
            values[rows] = self.values[i]
            if slope.any():
                elapsed = times[rows] - begins[i]
                values[rows] += elapsed[:, None] * slope
        return values, slopes

    def starts(self, start: float) -> Array:
        """Start of each segment (S,)."""
        return np.concatenate([[start], self.ends[:-1]])

    def column(self, i: int) -> list[Segment]:
        """The segments of one input."""
        values = self.values[:, i].tolist()
        slopes = self.slopes[:, i].tolist()
        return list(zip(self.ends.tolist(), values, slopes, strict=True))

    def check_shape(self, inputs: int, start: float, duration: float) -> None:
        """Raise ParameterError unless ends rise from `start` [s] for `duration` [s], and every
        segment has all inputs, all finite. Kernels rely on it; a run ends with its segments."""
        ends = self.ends
        values = self.values
        slopes = self.slopes
        end = start + duration
        shape = (ends.size, inputs)
        if ends.ndim != 1 or not ends.size or values.shape != shape or slopes.shape != shape:
            raise ParameterError(
                f"segments have ends {ends.shape}, values {values.shape} and slopes {slopes.shape};"
                f" for {inputs} inputs they must be (S,), (S, {inputs}) and (S, {inputs}), with at"
                " least one segment."
            )
        if not (all_finite(ends) and all_finite(values) and all_finite(slopes)):
            raise ParameterError("segments hold a number that is not finite.")
        if ends[0] <= start or not (ends[1:] > ends[:-1]).all():
            raise ParameterError(
                f"segments must end in rising order after {start:g} s; they end at"
                f" {ends.tolist()} s."
            )
        if abs(ends[-1] - end) > max(1e-9 * duration, 4 * np.spacing(abs(end))):
            raise ParameterError(
                f"segments end at {ends[-1]:g} s; they must end with the run, at {end:g} s."
            )

    def as_floats(self) -> "PiecewiseLinear":
        """The same inputs as arrays that a kernel can read: contiguous, writeable, of float64."""
        tables = (self.ends, self.values, self.slopes)
        if all(t.dtype == np.float64 and t.flags.carray for t in tables):
            return self
        return PiecewiseLinear(*(np.array(t, dtype=float, order="C") for t in tables))

    def split_at(self, starts: Array, start: float) -> "PiecewiseLinear":
        """The same inputs with segments that start at other instants (R,), in rising order, the
        first not before `start`; no segment may end within one of them."""
        ends = np.append(starts[1:], self.ends[-1])
        return PiecewiseLinear(ends, *self.at_rising(starts, start))


def merge_columns(columns: Sequence[Sequence[Segment]], start: float) -> PiecewiseLinear:
    """Common segments for several inputs, one or more: split wherever one of them is."""
    if max(map(len, columns)) == 1:
        ends, levels, rates = zip(*(column[0] for column in columns), strict=True)
        levels_at_start = [level + 0.0 * rate for level, rate in zip(levels, rates, strict=True)]
        return PiecewiseLinear(np.array(ends[:1]), np.array([levels_at_start]), np.array([rates]))
    instants = {start}
    for column in columns:
        instants.update(end for end, _, _ in column[:-1])
    starts = sorted(instants)
    shape = len(starts), len(columns)
    values = np.empty(shape)
    slopes = np.empty(shape)
    for i, column in enumerate(columns):
        values[:, i], slopes[:, i] = _at_instants(column, starts)
    end, _, _ = columns[0][-1]
    return PiecewiseLinear(np.array([*starts[1:], end]), values, slopes)


def _at_instants(
    column: Sequence[Segment], instants: list[float]
) -> tuple[list[float], list[float]]:
    """The values and slopes of one input at rising instants, from its start on."""
    values = []
    slopes = []
    begin = instants[0]
    k = 0
    last = len(column) - 1
    for time in instants:
        while k < last and column[k][0] <= time:
            begin = column[k][0]
            k += 1
        _, value, slope = column[k]
        values.append(value + (time - begin) * slope)
        slopes.append(slope)
    return values, slopes


class InputSignal(abc.ABC):
    """The inputs of a plant as functions of time."""

    @abc.abstractmethod
    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        """These inputs from `start` [s] on for `duration` [s], in segments in which every input is
        linear.

        Raises ParameterError for an input that the plant does not have.
        """

    def checked_segments(
        self, inputs: Sequence[str], start: float, duration: float
    ) -> PiecewiseLinear:
        """The same as arrays that a kernel can read. Raises ParameterError also for segments that
        do not rise in time, lack an input or hold a number that is not finite."""
        segments = self.segments(inputs, start, duration)
        segments.check_shape(len(inputs), start, duration)
        return segments.as_floats()

    @property
    def names(self) -> tuple[str, ...] | None:
        """The inputs that the signal names; None if it names none."""
        return None


def check_input_signal(signal: object) -> None:
    """Raise ParameterError for anything that is not an InputSignal, such as a dictionary."""
    if not isinstance(signal, InputSignal):
        remedy = ""
        if isinstance(signal, Mapping) and signal:
            remedy = (
                f" Schedule({{{next(iter(signal))!r}: ((0, 1.0),)}}) is an input of 1 from 0 s on."
            )
        raise ParameterError(
            f"the input is {abridged(signal)}; give a Schedule, a SampledSignal or another"
            f" InputSignal.{remedy}"
        )


def check_input_names(names: Iterable[str], inputs: Sequence[str], prefix: str = NO_INPUT) -> None:
    """Raise ParameterError, with the nearest name, for a name that is no input of the plant."""
    check_known(prefix, names, inputs)


def check_mapping(kind: str, mapping: object, example: str = "((5, 1), (15, 0))") -> None:
    """Raise ParameterError for anything that does not name inputs."""
    if not isinstance(mapping, Mapping):
        raise ParameterError(
            f"a {kind} is {abridged(mapping)}; name the inputs: {{'fill': {example}}}."
        )


def as_pairs(
    kind: str, noun: str, name: str, pairs: Sequence[tuple[float, float]]
) -> list[tuple[float, float]]:
    """Pairs of time and value as finite numbers, the times rising. Raises ParameterError for
    anything else.
    """
    try:
        points = [(as_float("a time", time), as_float("a value", value)) for time, value in pairs]
    except (TypeError, ValueError, ParameterError):
        raise ParameterError(
            f"the {kind} of '{name}' is {one_line(pairs)}; write pairs of time [s] and value, ((5,"
            " 1), (15, 0))."
        ) from None
    if points and not np.isfinite(points).all():
        raise ParameterError(
            f"the {kind} of '{name}' holds a number that is not finite: {one_line(points)}."
        )
    for i, (a, b) in enumerate(itertools.pairwise(time for time, _ in points)):
        if b <= a:
            raise ParameterError(
                f"the {kind} of '{name}' must list its {noun} in rising order; number {i + 2},"
                f" {b:g} s, follows {a:g} s."
            )
    return points


@dataclasses.dataclass(frozen=True)
class Schedule(InputSignal):
    """Piecewise constant inputs, each a sequence of (instant [s], value from then on); 0 before the
    first instant.

    `Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)})`
    """

    from_file: ClassVar[bool] = True

    changes: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        check_mapping("schedule", self.changes)
        changes = {}
        for name, given in self.changes.items():
            pairs = as_pairs("schedule", "instants", name, given)
            changes[name] = [t for t, _ in pairs], [0.0, *(v for _, v in pairs)]
        object.__setattr__(self, "_changes", changes)
        object.__setattr__(self, "_last", ((), 0.0, 0.0, None))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.changes)

    def checked_segments(
        self, inputs: Sequence[str], start: float, duration: float
    ) -> PiecewiseLinear:
        """As of any signal, in arrays that cannot be written to; those of the last call are kept
        for the next one.
        """
        *asked, segments = self._last  # type: ignore[attr-defined]
        if segments is None or asked != [inputs, start, duration]:
            segments = super().checked_segments(inputs, start, duration)
            for table in (segments.ends, segments.values, segments.slopes):
                table.setflags(write=False)
            object.__setattr__(self, "_last", (inputs, start, duration, segments))
        return segments  # type: ignore[no-any-return]

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        changes: dict[str, tuple[list[float], list[float]]] = self._changes  # type: ignore[attr-defined]
        check_input_names(changes, inputs)
        end = start + duration
        instants: set[float] = set()
        for times, _ in changes.values():
            instants.update(time for time in times if start < time < end)
        starts = [start, *sorted(instants)]
        values = np.zeros((len(starts), len(inputs)))
        for i, name in enumerate(inputs):
            if name in changes:
                times, levels = changes[name]
                values[:, i] = [levels[bisect.bisect_right(times, time)] for time in starts]
        ends = np.array([*starts[1:], end])
        return PiecewiseLinear(ends, values, np.zeros(values.shape))


@dataclasses.dataclass(frozen=True)
class Periodic(InputSignal):
    """The first `period` [s] of another input signal, from its time 0 on, repeated for all times.

    Drivers are wrapped around it, `WithDrivers(Periodic(...), ...)`: inside they would start anew
    in every period.
    """

    inner: InputSignal
    period: float

    names = forwarded("inner.names")

    def __post_init__(self) -> None:
        check_input_signal(self.inner)
        if not 0 < as_float("Periodic.period", self.period) < np.inf:
            raise ParameterError(
                f"Periodic.period is {self.period!r} s; it must be positive and finite."
            )

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        once = self.inner.segments(inputs, 0.0, self.period)
        end = start + duration
        first = np.floor(start / self.period)
        last = np.ceil(end / self.period)
        if (last - first) * once.ends.size > MAX_INSTANTS:
            raise ParameterError(
                f"an input of {once.ends.size} segments every {self.period:g} s makes more than"
                f" {MAX_INSTANTS} instants in {duration:g} s. Simulate a shorter time."
            )
        begins = self.period * np.arange(first, last)
        size = (int(last - first), 1)
        starts = (begins[:, None] + once.starts(0.0)).ravel()
        # 3 * 0.1 is more than 0.3: no segment of 1e-17 s
        rounding = 4 * np.spacing(max(abs(start), self.period))
        is_start = np.abs(starts - start) <= rounding
        starts[is_start] = start
        ends = np.append(starts[1:], end)
        values = np.tile(once.values, size)
        slopes = np.tile(once.slopes, size)
        repeated = PiecewiseLinear(ends, values, slopes)
        is_within = (starts > start) & (starts < end)
        within = np.append(start, starts[is_within])
        return repeated.split_at(within, float(starts[0]))


@dataclasses.dataclass(frozen=True)
class CombinedSignal(InputSignal):
    """The inputs that `inner` names from `inner`, all others from `other`."""

    inner: InputSignal
    other: InputSignal

    @property
    def names(self) -> tuple[str, ...] | None:
        names_of_other = self.other.names
        return None if names_of_other is None else (*(self.inner.names or ()), *names_of_other)

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        inner_segments, other_segments = (
            signal.segments(inputs, start, duration) for signal in (self.inner, self.other)
        )
        named = self.inner.names or ()
        columns = [
            (inner_segments if name in named else other_segments).column(i)
            for i, name in enumerate(inputs)
        ]
        return merge_columns(columns, start) if columns else other_segments


ZERO_INPUT = Schedule({})
"""Every input is zero: valves closed, latch open."""
