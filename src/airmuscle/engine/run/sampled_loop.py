"""SampledLoop: a control loop prepared for one run, its drivers as arrays of a kernel; controllers
that are called.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError
from ..compile.kernel_layout import DriverKind
from ..loop import (
    PWM,
    ControlLaw,
    ControlLoop,
    ControlLoopState,
    InputSignal,
    Measurement,
    PwmState,
    SolenoidDriver,
)
from ..loop.inputs import PiecewiseLinear
from ..loop.pwm_and_solenoid import MAX_PERIODS, SolenoidState, apply_drivers, check_command_range
from .problem import Problem, output_times

MAX_SAMPLES = 10_000_000
"""Samples of one run that fit a usual memory."""
CLOSE = 1e-9
"""Part of a sample time within which two instants are one: rounding separates 3 * 0.1 from 0.3."""
MAX_CAPACITY = 1_000_000
"""Segments of an input within an interval up to which a kernel computes them."""
WIDTH = 4
"""Numbers of the settings and of the state of a driver."""
KINDS: dict[type, DriverKind] = {PWM: DriverKind.MODULATOR, SolenoidDriver: DriverKind.SWITCH}
"""The drivers that kernels and exported programs implement."""
_STATES: dict[type, Any] = {PWM: PwmState, SolenoidDriver: SolenoidState}


@dataclasses.dataclass(frozen=True, eq=False)
class SampledLoop:
    """A control loop prepared for one run.

    instants         (K + 1,) start of the run, sampling instants, end of the run [s]
    sampled          whether the first interval begins with a sample: not when a run continues
                     between two samples
    inputs           segments of all inputs, split at the instants; commanded inputs are filled in
                     during the run
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
        """The interval (N,) and the set points (N, s) of each output time; nobody can write to
        them.
        """
        intervals, setpoints = self.at(self.times)
        for array in (intervals, setpoints):
            array.setflags(write=False)
        return intervals, setpoints

    def at(self, times: Array) -> tuple[npt.NDArray[np.int64], Array]:
        """The interval (N,) and the set points (N, s) at rising times (N,)."""
        return (
            intervals_of(times, self.instants),
            self.setpoint_signal.at_rising(times, float(self.instants[0]))[0],
        )


def prepare_loop(problem: Problem, state: ControlLoopState) -> SampledLoop:
    """The control loop of a problem, prepared for its run."""
    loop = problem.input
    compiled = problem.compiled
    start = problem.start_time
    assert isinstance(loop, ControlLoop)
    known = compiled.description
    duration = problem.duration
    names = known.input_names
    _check_state(state, loop, len(names))
    edges, sampled = _edges(loop.sample_time, state, start, problem.end_time)
    close = CLOSE * loop.sample_time
    uncommanded = snapped(loop.other_inputs, names, edges, close)
    starts = edges[:-1]
    changes = uncommanded.ends[:-1]
    if not (starts[np.minimum(starts.searchsorted(changes), starts.size - 1)] == changes).all():
        starts = np.unique(np.concatenate([starts, changes]))
    inputs = uncommanded.split_at(starts, start).as_floats()
    commanded = [names.index(name) for name in loop.controller.inputs]
    for column in commanded:
        inputs.values[:, column] = inputs.slopes[:, column] = 0.0
    first_segments = np.arange(edges.size)
    if starts.size >= edges.size:
        first_segments[:-1] = np.searchsorted(starts, edges[:-1])
        first_segments[-1] = starts.size
    times = output_times(
        problem.output_times, start, duration, np.concatenate([[start], inputs.ends])
    )
    setpoint = snapped(loop.setpoint, loop.controller.setpoints, edges, close)
    setpoints, _ = setpoint.at_rising(edges[:-1], start)
    return SampledLoop(
        loop,
        edges,
        sampled,
        inputs,
        first_segments,
        commanded,
        setpoint,
        setpoints,
        times,
        first_rows_of(times, edges),
        names,
        loop.command_ranges(compiled.system),
    )


def _check_state(state: ControlLoopState, loop: ControlLoop, inputs: int) -> None:
    """Raise ParameterError for the state of a loop with another controller, with other drivers, or
    at another plant.
    """
    law = loop.controller
    memory = state.controller if isinstance(state.controller, Mapping) else {}
    drivers = {name: len(chain) for name, chain in loop.driven_inputs.chains.items()}
    if (
        (len(state.measured), len(state.commanded)) != (len(law.measured_columns), len(law.inputs))
        or len(state.applied_inputs) not in (0, inputs)
        or {name: len(states) for name, states in state.drivers.items()} != drivers
        or (isinstance(law, ControlLaw) and set(memory) != set(law.initial_memory))
    ):
        raise ParameterError(
            f"the control_state is not that of this loop of a {type(law).__name__}; give one that a"
            " run with the same controller, drivers and plant returned."
        )


def first_rows_of(times: Array, instants: Array) -> npt.NDArray[np.int64]:
    """The first output time of each interval (K + 1,); the rows at the end of an interval belong to
    it.
    """
    if times.size == instants.size and (times == instants).all():
        rows = np.arange(1, times.size + 1)
    else:
        rows = np.searchsorted(times, instants, side="right")
    rows[0] = 0
    return rows


def intervals_of(times: Array, instants: Array) -> npt.NDArray[np.int64]:
    """The interval in which each output time is; where one ends and another begins, the later
    one.
    """
    if times.size == instants.size and (times == instants).all():
        return np.arange(times.size)
    return np.maximum(np.searchsorted(instants, times, side="right") - 1, 0)


def _edges(
    sample_time: float, state: ControlLoopState, start: float, end: float
) -> tuple[Array, bool]:
    """Start, the sampling instants after it, and end of a run [s]; whether the start is a sampling
    instant itself.
    """
    count = (end - state.origin) / sample_time - state.sample_count
    close = CLOSE * sample_time
    if count > MAX_SAMPLES:
        raise ParameterError(
            f"a sample time of {sample_time:g} s makes {count:.3g} samples; {MAX_SAMPLES} are"
            " allowed. Lengthen it, or simulate a shorter time."
        )
    instants = state.origin + sample_time * (
        state.sample_count + np.arange(max(math.ceil(count), 0) + 1)
    )
    if abs(start - state.time) > close:
        raise ParameterError(
            f"the control_state is that of {state.time:.10g} s, and the run begins at {start:.10g}"
            " s. Give the time that was returned with it."
        )
    within = instants[(instants > start + close) & (instants < end - close)]
    return np.concatenate([[start], within, [end]]), bool(instants[0] <= start + close)


def snapped(
    signal: InputSignal, names: tuple[str, ...], edges: Array, close: float
) -> PiecewiseLinear:
    """The segments of a signal; an end that is close to a sampling instant is moved to it."""
    start = float(edges[0])
    segments = signal.segments(names, start, float(edges[-1]) - start)
    ends = segments.ends
    behind = np.maximum(edges.searchsorted(ends), 1)
    behind = np.minimum(behind, edges.size - 1)
    before = edges.take(behind - 1)
    after = edges.take(behind)
    nearest = np.where(ends - before < after - ends, before, after)
    distance = np.abs(nearest - ends)
    ends = np.where(distance <= close, nearest, ends)
    if ends[0] > start and (ends[1:] > ends[:-1]).all():
        return PiecewiseLinear(ends, segments.values, segments.slopes)
    # of two segments that end at one instant the first has no length
    starts = np.concatenate([edges[:1], ends[:-1]])
    has_length = ends > starts
    return PiecewiseLinear(
        ends[has_length],
        segments.values[has_length],
        segments.slopes[has_length],
    )


class CalledController:
    """The controller of a prepared loop with what it needs at each sample; its memory belongs to
    the run.
    """

    def __init__(self, prepared: SampledLoop) -> None:
        loop = prepared.loop
        self._controller = loop.controller
        self._sample_time = loop.sample_time
        self._ranges = prepared.ranges
        self._columns = loop.controller.measured_columns
        self._names = loop.controller.setpoints
        self._inputs = tuple(prepared.ranges)
        self._rows: list[list[float]] = prepared.setpoint_values.tolist()
        self._last: tuple[list[float], dict[str, float]] = [], {}

    def step(
        self, memory: Any, measured: Sequence[float], interval: int
    ) -> tuple[list[float], Any]:
        """The commands of a sample at the start of an interval, not limited, and the memory after
        it.

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
                f"{type(self._controller).__name__} commands {commands!r}; it must give a number"
                f" for each of {', '.join(self._inputs)}."
            ) from None


def are_called(prepared: SampledLoop) -> bool:
    """Whether a driver of a loop must be called from Python, because the kernel does not implement
    it.
    """
    known = all(
        type(driver) in KINDS
        for chain in prepared.loop.driven_inputs.chains.values()
        for driver in chain
    )
    return not known or max_capacity(prepared) > MAX_CAPACITY


def max_capacity(prepared: SampledLoop) -> int:
    """The maximum number of segments of an input within an interval, before and after each of its
    drivers.
    """
    duration = float(np.diff(prepared.instants).max())
    greatest = pieces = int(np.diff(prepared.first_segments).max())
    for chain in prepared.loop.driven_inputs.chains.values():
        count = pieces
        for driver in chain:
            if isinstance(driver, PWM):
                count = 2 * (math.ceil(min(duration * driver.frequency, MAX_PERIODS)) + 4)
            else:
                count = 4 * count + 4
            greatest = max(greatest, count)
    return greatest


class DriverTable:
    """The drivers (D,) of all inputs as arrays, in the order in which a signal passes through them.

    kinds (D, 2)      index of the input, and DriverKind
    settings, states, kept (D, 4)   settings; states at the end of the present and of the last
                                    completed interval
    columns, scratch, counts, begins    workspace of the kernel
    called  whether the drivers are called from Python, in the signals of the kernel
    """

    def __init__(
        self, prepared: SampledLoop, state: ControlLoopState, capacity: int, called: bool = False
    ) -> None:
        loop = prepared.loop
        inputs = prepared.inputs
        names = prepared.input_names
        chains = loop.driven_inputs.chains
        self.called = called
        self._chains = chains
        self._indices = {name: names.index(name) for name in chains}
        self._order = [
            (name, driver) for name, chain in chains.items() for driver in chain if not called
        ]
        for name in chains:
            if name not in loop.controller.inputs:
                check_command_range(
                    name, inputs.column(names.index(name)), float(prepared.instants[0])
                )
        m = inputs.values.shape[1]
        self.kinds = np.array(
            [(names.index(n), KINDS[type(d)]) for n, d in self._order], np.int64
        ).reshape(-1, 2)
        if called:
            self.kinds = np.array([(-1, -1)])
        self.settings = _table(
            [d.settings for _, d in self._order if isinstance(d, PWM | SolenoidDriver)]
        )
        self.kept = _table(
            [
                tuple(driver_state)
                for name in chains
                for driver_state in state.drivers[name]
                if not called
            ]
        )
        self.states, self._first = self.kept.copy(), self.kept.copy()
        self.columns, self.scratch = np.empty((m, 3, capacity)), np.empty((2, 3, capacity))
        self.counts, self.begins = np.zeros((2, m), dtype=np.int64), np.empty(m)
        self._first_called = state.drivers
        self.restart()

    def restart(self) -> None:
        """The states at the beginning of the loop."""
        self.states[:] = self.kept[:] = self._first
        self._before = self._after = self._first_called
        self._called_at = -1

    def call(self, interval: int, begin: float) -> int:
        """Replace the signals of an interval by those behind the drivers; how many segments they
        have together.
        """
        counts = self.counts[0].tolist()
        signals = [
            list(zip(*self.columns[i, :, :count].tolist(), strict=True))
            for i, count in enumerate(counts)
        ]
        self._before = self._after
        self._called_at = interval
        self._after = apply_drivers(self._chains, self._before, signals, self._indices, begin)
        counts = list(map(len, signals))
        if max(counts) > self.columns.shape[2]:
            self.columns = np.empty((*self.columns.shape[:2], 2 * max(counts)))
        for i, signal in enumerate(signals):
            self.columns[i, :, : counts[i]] = np.array(signal).T
        self.counts[0] = counts
        return sum(counts)

    def as_mapping(self, done: int) -> Mapping[str, tuple[Any, ...]]:
        """The drivers' states at the end of the last of so many completed intervals, by input."""
        if self.called:  # the last call may be that of an interval that was not completed
            return self._after if done > self._called_at else self._before
        by_name: dict[str, tuple[Any, ...]] = dict.fromkeys(self._chains, ())
        for (name, driver), row in zip(self._order, self.kept.tolist(), strict=True):
            kind = _STATES[type(driver)]
            by_name[name] = (*by_name[name], kind(*row[: len(kind._fields)]))
        return by_name


def _table(rows: list[tuple[float, ...]]) -> Array:
    return np.array([(*row, *[0.0] * (WIDTH - len(row))) for row in rows], dtype=float).reshape(
        -1, WIDTH
    )
