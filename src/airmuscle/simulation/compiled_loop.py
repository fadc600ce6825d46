"""Control loop as one program: a control law, drivers and plant from sample to sample without a return to Python."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..compile.cache import kernel
from ..compile.function import Function
from ..compile.kernel_layout import DriverKind, Progress
from ..control.control_law import ControlLaw
from ..control.control_loop import ControlLoopState
from ..control.driver import MAX_PERIODS, PWM, Driver, PwmState, SolenoidDriver, SolenoidState
from ..control.piecewise_linear import PiecewiseLinear
from ..control.with_drivers import WithDrivers, check_command_range
from ..core.arrays import Array
from ..core.status import Status
from .compiled_law import compiled_sample, parameters_of
from .integrators import INTERRUPT_CHECK_STEPS, MAX_STEPS
from .problem import Problem
from .sampled_loop import SampledLoop

_KINDS: dict[type, DriverKind] = {PWM: DriverKind.MODULATOR, SolenoidDriver: DriverKind.SWITCH}
_STATES: dict[type, Any] = {PWM: PwmState, SolenoidDriver: SolenoidState}
FIRST_SEGMENTS = 4096
"""Segments and rows that the buffers of driven inputs hold at first."""
MAX_CAPACITY = 1_000_000
"""Segments of an input within an interval up to which a kernel computes them."""


def can_be_compiled(prepared: SampledLoop) -> bool:
    """Whether the loop consists of what kernels know: a control law, and drivers of this package."""
    chains = list(WithDrivers(prepared.loop.other_inputs, prepared.loop.drivers).chains.values())
    if not isinstance(prepared.loop.controller, ControlLaw):
        return False
    if not all(type(driver) in _KINDS for chain in chains for driver in chain):
        return False
    return _greatest_capacity(prepared, chains) <= MAX_CAPACITY


class CompiledRun:
    """A control loop that is simulated by one kernel; the results are those of `closed_loop`, to rounding errors.

    It has the attributes of the run that calls a controller at each sample.
    """

    def __init__(self, problem: Problem, prepared: SampledLoop, control_state: ControlLoopState) -> None:
        self.problem, self.prepared, self._begin_state = problem, prepared, control_state
        assert problem.integrator is not None
        self.bound = problem.integrator.bind(problem.compiled)
        self.bound.state[:] = problem.initial_vector
        self.status, self.stopped_at = Status.DONE, problem.start_time
        law = prepared.loop.controller
        assert isinstance(law, ControlLaw)
        self._law: ControlLaw = law
        self._function: Function = compiled_sample(law)
        self._drivers = _DriverTable(prepared, control_state)
        self._arrays()
        self._kernel = kernel.sampled_loop.bind(*self._arguments())

    @property
    def can_run(self) -> bool:
        """Whether the machine code of the integrator can be called by another kernel."""
        return self.bound.entry_address is not None

    def _arrays(self) -> None:
        problem, prepared, state = self.problem, self.prepared, self._begin_state
        sizes, law = problem.compiled.sizes, self._law
        intervals, m = len(prepared.edges) - 1, sizes.inputs
        inputs = prepared.inputs
        self.progress = np.zeros(len(Progress), dtype=np.int64)
        self._memory = np.array([list(state.controller.values())] * 2, dtype=float).reshape(2, -1)
        self._measured = np.array(state.measured, dtype=float)
        self._command = np.array(state.commanded, dtype=float)
        self._applied = np.array(state.applied_inputs or inputs.values[0], dtype=float)
        self._kept_applied = np.array(state.applied_inputs, dtype=float) if state.applied_inputs else np.empty(0)
        self._kept, self._kept_inputs = self.bound.state.copy(), self._applied.copy()
        self._samples = np.empty((intervals, len(law.measured_columns)))
        self._commands = np.empty((intervals, len(law.inputs)))
        if self._drivers.kinds.size:
            segments, rows = FIRST_SEGMENTS, FIRST_SEGMENTS
            room = self._drivers.capacity * m
            self._segments = np.empty(segments + room), np.empty((segments + room, m)), np.empty((segments + room, m))
            self._times, self._rows = np.empty(rows + 2 * room), np.empty((rows + 2 * room, sizes.states))
        else:
            self._segments = inputs.ends, inputs.values, inputs.slopes
            self._times, self._rows = prepared.times, np.empty((prepared.times.size, sizes.states))

    def _arguments(self) -> tuple[Any, ...]:
        problem, prepared, bound, drivers = self.problem, self.prepared, self.bound, self._drivers
        compiled, law, inputs = problem.compiled, self._law, prepared.inputs
        known = compiled.description
        columns = (*known.state_names, *known.output_names)
        measured_at = np.array([columns.index(name) for name in law.measured_columns], dtype=np.int64)
        commanded_at = np.array(prepared.commanded, dtype=np.int64)
        limits = np.array([prepared.ranges[name] for name in law.inputs], dtype=float).reshape(-1, 2)
        low, high = np.ascontiguousarray(limits[:, 0]), np.ascontiguousarray(limits[:, 1])
        edges = np.array(prepared.edges)
        setpoints = np.array(prepared.setpoints, dtype=float).reshape(edges.size - 1, -1)
        offsets = np.array(prepared.segment_offsets, dtype=np.int64)
        grid_rows = np.array(prepared.row_offsets, dtype=np.int64)
        sampled = 0 if prepared.sampled else 1
        return (
            bound.entry_address or 0, bound.slots, bound.places, bound.clock, bound.count, bound.state,
            compiled.address["outputs"], compiled.precomputed, np.empty(max(compiled.sizes.outputs, 1)), measured_at,
            self._function.address, parameters_of(law), np.array([prepared.loop.sample_time]), low, high, commanded_at,
            edges, np.spacing(np.abs(edges)), sampled, setpoints, inputs.ends, inputs.values, inputs.slopes, offsets,
            prepared.times, grid_rows, drivers.kinds, drivers.settings, drivers.states, drivers.columns, drivers.counts,
            drivers.scratch, drivers.begins, known.lower_bounds, self._applied, self._memory, self._measured,
            self._command, self._kept, self._kept_inputs, drivers.kept, *self._segments, self._times, self._rows,
            self._samples, self._commands, self.progress, INTERRUPT_CHECK_STEPS,
        )  # fmt: skip

    def integrate(self) -> None:
        """Run the loop until its end, or until an interval fails or the user stops it."""
        try:
            status = self._kernel()
            while status == Status.PAUSED and not self._takes_too_many_steps():
                if self.progress[Progress.FULL]:
                    self._extend()
                status = self._kernel()
        except KeyboardInterrupt:
            status = Status.INTERRUPTED
        self.status = Status.TOO_MANY_STEPS if status == Status.PAUSED else Status(status)
        self.stopped_at = float(self.bound.clock[0]) if self.progress[Progress.SAMPLES] else self.stopped_at
        if self.status == Status.INTERRUPTED:
            self._discard_interval()

    def _takes_too_many_steps(self) -> bool:
        running = self.progress[Progress.RUNNING]
        return bool(running and self.bound.count[2] - self.progress[Progress.STEPS_BEFORE] >= MAX_STEPS)

    def _extend(self) -> None:
        """Longer buffers for the segments and rows of driven inputs."""
        self._segments = tuple(_longer(array) for array in self._segments)  # type: ignore[assignment]
        self._times, self._rows = _longer(self._times), _longer(self._rows)
        first = len(self._arguments()) - 9
        for i, array in enumerate((*self._segments, self._times, self._rows), first):
            self._kernel.replace(i, array)
        self.progress[Progress.FULL] = 0

    def _discard_interval(self) -> None:
        """Forget an interval that was interrupted, so that the run can be continued from its beginning."""
        progress = self.progress
        if progress[Progress.RUNNING]:
            progress[Progress.SEGMENTS], progress[Progress.ROWS] = progress[Progress.FIRST_SEGMENT], progress[
                Progress.FIRST_ROW
            ]
            progress[Progress.SAMPLES] = progress[Progress.INTERVAL]
        self.stopped_at, self.bound.state[:] = self.time, self._kept

    @property
    def time(self) -> float:
        """The end of the last completed interval [s]."""
        return self.prepared.edges[int(self.progress[Progress.INTERVAL])]

    @property
    def state(self) -> Array:
        """The state (n,) at the end of the last completed interval."""
        return self._kept

    @property
    def measured(self) -> Array:
        """Measurements (K, columns) of every interval that has begun."""
        return self._samples[: self.progress[Progress.SAMPLES]]

    @property
    def commanded(self) -> Array:
        """Commands (K, inputs) of every interval that has begun."""
        return self._commands[: self.progress[Progress.SAMPLES]]

    @property
    def signal(self) -> PiecewiseLinear:
        """The segments of all inputs of the intervals that have begun."""
        count = int(self.progress[Progress.SEGMENTS])
        ends, values, slopes = (array[:count] for array in self._segments)
        return PiecewiseLinear(ends, values, slopes)

    @property
    def rows(self) -> tuple[Array, Array]:
        """Times (N,) and states (N, n) of the rows that were reached."""
        count = int(self.progress[Progress.ROWS])
        return self._times[:count], self._rows[:count]

    @property
    def control_state(self) -> ControlLoopState:
        """The state of the loop at the end of the last completed interval."""
        done, begun, sampled = int(self.progress[Progress.INTERVAL]), self._begin_state, self.prepared.sampled
        if not done:
            return begun
        return ControlLoopState(
            controller=dict(zip(self._law.initial_memory, self._memory[0].tolist(), strict=True)),
            origin=begun.origin,
            time=self.time,
            sample_count=begun.sample_count + done - (0 if sampled else 1),
            measured=tuple(self._samples[done - 1].tolist()),
            commanded=tuple(self._commands[done - 1].tolist()),
            applied_inputs=tuple(self._kept_inputs.tolist()),
            drivers=self._drivers.as_mapping(),
        )


class _DriverTable:
    """The drivers of all inputs as arrays, in the order in which a signal passes through them."""

    def __init__(self, prepared: SampledLoop, state: ControlLoopState) -> None:
        loop, inputs = prepared.loop, prepared.inputs
        chains = WithDrivers(loop.other_inputs, loop.drivers).chains
        names = prepared.input_names
        self._order = [(name, driver) for name, chain in chains.items() for driver in chain]
        start = prepared.edges[0]
        for name in chains:
            if name not in loop.controller.inputs:
                check_command_range(name, inputs.column(names.index(name)), start)
        count, m = len(self._order), inputs.values.shape[1]
        self.kinds = np.array([(names.index(n), _KINDS[type(d)]) for n, d in self._order], np.int64).reshape(-1, 2)
        self.settings = _table([_settings(driver) for _, driver in self._order])
        states = [one for name in chains for one in state.drivers[name]]
        self.kept = _table([tuple(one) for one in states])
        self.states = self.kept.copy()
        self.capacity = _greatest_capacity(prepared, list(chains.values()))
        width = self.capacity if count else 0
        self.columns, self.scratch = np.empty((m, 3, width)), np.empty((2, 3, width))
        self.counts, self.begins = np.zeros((2, m), dtype=np.int64), np.empty(m)

    def as_mapping(self) -> Mapping[str, tuple[Any, ...]]:
        """The drivers' states at the end of the last completed interval, by input."""
        by_name: dict[str, tuple[Any, ...]] = {name: () for name, _ in self._order}
        for (name, driver), row in zip(self._order, self.kept.tolist(), strict=True):
            kind = _STATES[type(driver)]
            by_name[name] = (*by_name[name], kind(*row[: len(kind._fields)]))
        return by_name


def _settings(driver: Driver) -> tuple[float, ...]:
    if isinstance(driver, PWM):
        return driver.frequency, driver.smallest_pulse
    assert isinstance(driver, SolenoidDriver)
    return driver.opening_delay, driver.closing_delay, driver.opening_ramp, driver.closing_ramp


def _table(rows: list[tuple[float, ...]]) -> Array:
    """Rows of at most four numbers as an array (D, 4)."""
    return np.array([(*row, *[0.0] * (4 - len(row))) for row in rows], dtype=float).reshape(-1, 4)


def _greatest_capacity(prepared: SampledLoop, chains: list[tuple[Driver, ...]]) -> int:
    """The greatest number of segments of an input within an interval."""
    duration = float(np.diff(prepared.edges).max())
    pieces = int(np.diff(prepared.segment_offsets).max())
    return max((_capacity(chain, pieces, duration) for chain in chains), default=pieces)


def _capacity(chain: tuple[Driver, ...], pieces: int, duration: float) -> int:
    """The greatest number of segments of an input before and after each of its drivers."""
    greatest = pieces
    for driver in chain:
        if isinstance(driver, PWM):
            pieces = 2 * (math.ceil(min(duration * driver.frequency, MAX_PERIODS)) + 4)
        else:
            pieces = 4 * pieces + 4
        greatest = max(greatest, pieces)
    return greatest


def _longer(array: Array) -> Array:
    longer = np.empty((2 * len(array), *array.shape[1:]))
    longer[: len(array)] = array
    return longer
