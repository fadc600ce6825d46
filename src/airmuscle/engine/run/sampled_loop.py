"""SampledLoop: a control loop prepared for one run, what does not change from sample to sample; called controllers."""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError
from ..loop import FEW_SEGMENTS, ControlLoop, ControlLoopState, InputSignal, Measurement, PiecewiseLinear
from .output_times import output_times
from .problem import Problem

MAX_SAMPLES = 10_000_000
"""Samples of one run that fit a usual memory."""
CLOSE = 1e-9
"""Part of a sample time within which two instants are one: rounding separates 3 * 0.1 from 0.3."""


@dataclasses.dataclass(frozen=True, eq=False)
class SampledLoop:
    """A control loop prepared for one run.

    instants         (K + 1,) start of the run, sampling instants, end of the run [s]
    sampled          whether the first interval begins with a sample: not when a run continues between two samples
    inputs           segments of all inputs, split at the instants; commanded inputs are filled in during the run
    first_segments   (K + 1,) the first segment of each interval
    setpoint_values  (K, s) set points at the start of every interval
    times            output times; drivers add instants
    first_rows       (K + 1,) the first output time of each interval
    input_names      of the plant
    ranges           minimum and maximum of every commanded input
    """

    loop: ControlLoop
    instants: Array
    sampled: bool
    inputs: PiecewiseLinear
    first_segments: npt.NDArray[np.int64]
    commanded: list[int]
    setpoint_signal: PiecewiseLinear
    setpoint_values: Array
    times: Array
    first_rows: npt.NDArray[np.int64]
    input_names: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]]

    @functools.cached_property
    def at_times(self) -> tuple[npt.NDArray[np.int64], Array]:
        """The interval (N,) and the set points (N, s) of each output time; nobody can write to them."""
        intervals, setpoints = self.at(self.times)
        for array in (intervals, setpoints):
            array.setflags(write=False)
        return intervals, setpoints

    def at(self, times: Array) -> tuple[npt.NDArray[np.int64], Array]:
        """The interval (N,) and the set points (N, s) at rising times (N,)."""
        return intervals_of(times, self.instants), self.setpoint_signal.at_rising(times, float(self.instants[0]))[0]


def prepare_loop(problem: Problem, state: ControlLoopState) -> SampledLoop:
    """The control loop of a problem, prepared for its run."""
    loop, compiled, start = problem.input, problem.compiled, problem.start_time
    assert isinstance(loop, ControlLoop)
    known, duration = compiled.description, problem.duration
    names = known.input_names
    edges, sampled = _edges(loop.sample_time, state, start, problem.end_time)
    close = CLOSE * loop.sample_time
    others = snapped(loop.other_inputs, names, edges, close)
    starts = _merged(edges[:-1], others.ends[:-1])
    inputs = others.split_at(starts, start).as_floats()
    commanded = [names.index(name) for name in loop.controller.inputs]
    for column in commanded:
        inputs.values[:, column] = inputs.slopes[:, column] = 0.0
    first_segments = np.arange(edges.size)
    if starts.size >= edges.size:
        first_segments[:-1], first_segments[-1] = np.searchsorted(starts, edges[:-1]), starts.size
    times = output_times(problem.output_times, start, duration, np.append(start, inputs.ends))
    setpoint = snapped(loop.setpoint, loop.controller.setpoints, edges, close)
    setpoints, _ = setpoint.at_rising(edges[:-1], start)
    return SampledLoop(
        loop, edges, sampled, inputs, first_segments, commanded, setpoint, setpoints, times,
        first_rows_of(times, edges), names, loop.command_ranges(compiled.system),
    )  # fmt: skip


def first_rows_of(times: Array, instants: Array) -> npt.NDArray[np.int64]:
    """The first output time of each interval (K + 1,); the rows at the end of an interval belong to it."""
    if times.size == instants.size and (times == instants).all():
        rows = np.arange(1, times.size + 1)
    else:
        rows = np.searchsorted(times, instants, side="right")
    rows[0] = 0
    return rows


def intervals_of(times: Array, instants: Array) -> npt.NDArray[np.int64]:
    """The interval in which each output time is; where one ends and another begins, the later one."""
    if times.size == instants.size and (times == instants).all():
        return np.arange(times.size)
    return np.maximum(np.searchsorted(instants, times, side="right") - 1, 0)


def _merged(instants: Array, others: Array) -> Array:
    """The instants and the others, both rising, each once."""
    at = np.minimum(instants.searchsorted(others), instants.size - 1)
    return instants if (instants[at] == others).all() else np.unique(np.concatenate([instants, others]))


def _edges(sample_time: float, state: ControlLoopState, start: float, end: float) -> tuple[Array, bool]:
    """Start, the sampling instants after it, and end of a run [s]; whether the start is a sampling instant itself."""
    count, close = (end - state.origin) / sample_time - state.sample_count, CLOSE * sample_time
    if count > MAX_SAMPLES:
        raise ParameterError(
            f"a sample time of {sample_time:g} s makes {count:.3g} samples; {MAX_SAMPLES} are allowed. Lengthen it, or "
            "simulate a shorter time."
        )
    instants = state.origin + sample_time * (state.sample_count + np.arange(max(math.ceil(count), 0) + 1))
    if abs(start - state.time) > close:
        raise ParameterError(
            f"the control_state is that of {state.time:.10g} s, and the run begins at {start:.10g} s. Give the time "
            "that was returned with it."
        )
    within = instants[(instants > start + close) & (instants < end - close)]
    return np.concatenate([[start], within, [end]]), bool(instants[0] <= start + close)


def snapped(signal: InputSignal, names: tuple[str, ...], edges: Array, close: float) -> PiecewiseLinear:
    """The segments of a signal; an end that is close to a sampling instant is moved to it."""
    start = float(edges[0])
    segments = signal.segments(names, start, float(edges[-1]) - start)
    if segments.ends.size <= FEW_SEGMENTS:
        return _few_snapped(segments, edges, close)
    behind = np.clip(np.searchsorted(edges, segments.ends), 1, edges.size - 1)
    before, after = edges[behind - 1], edges[behind]
    nearest = np.where(segments.ends - before < after - segments.ends, before, after)
    ends = np.where(np.abs(nearest - segments.ends) <= close, nearest, segments.ends)
    kept = np.diff(ends, prepend=edges[0]) > 0
    return PiecewiseLinear(ends[kept], segments.values[kept], segments.slopes[kept])


def _few_snapped(segments: PiecewiseLinear, edges: Array, close: float) -> PiecewiseLinear:
    """The same of a few segments, one by one."""
    ends, kept, last = [], [], float(edges[0])
    behind = edges.searchsorted(segments.ends).tolist()
    for row, (end, i) in enumerate(zip(segments.ends.tolist(), behind, strict=True)):
        after = min(max(i, 1), edges.size - 1)
        low, high = edges[after - 1 : after + 1].tolist()
        nearest = low if end - low < high - end else high
        moved = nearest if abs(nearest - end) <= close else end
        if moved > last:
            ends.append(moved)
            kept.append(row)
        last = moved
    return PiecewiseLinear(np.array(ends), segments.values[kept], segments.slopes[kept])


class CalledController:
    """The controller of a prepared loop with what it needs at each sample; its memory belongs to the run."""

    def __init__(self, prepared: SampledLoop) -> None:
        loop = prepared.loop
        self._controller, self._sample_time, self._ranges = loop.controller, loop.sample_time, prepared.ranges
        self._columns, self._names = loop.controller.measured_columns, loop.controller.setpoints
        self._inputs = tuple(prepared.ranges)
        self._rows: list[list[float]] = prepared.setpoint_values.tolist()
        self._last: tuple[list[float], dict[str, float]] = [], {}

    def step(self, memory: Any, measured: Sequence[float], interval: int) -> tuple[list[float], Any]:
        """The commands of a sample at the start of an interval, not limited, and the memory after it.

        Raises ParameterError where the controller does not give a number for each input.
        """
        row = self._rows[interval]
        if row != self._last[0]:
            self._last = row, dict(zip(self._names, row, strict=True))
        columns = dict(zip(self._columns, measured, strict=True))
        measurement = Measurement(columns, self._last[1], self._ranges)
        commands, memory = self._controller.step(memory, measurement, self._sample_time)
        try:
            return [0.0 + commands[name] for name in self._inputs], memory
        except (KeyError, TypeError, ValueError):
            raise ParameterError(
                f"{type(self._controller).__name__} commands {commands!r}; it must give a number for each of "
                f"{', '.join(self._inputs)}."
            ) from None
