"""Control loop as one program: control law, drivers and plant from sample to sample without a
return to Python.

A controller that is no control law, and drivers that no kernel implements, are called from Python
at each sample.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, Status, flat_view
from ..compile.cache import kernel
from ..compile.kernel_layout import Progress, Waiting
from ..compile.program import CompiledSystem
from ..loop import ControlLaw, ControlLoopState, PiecewiseLinear
from .compiled_law import compiled_sample, parameters_of
from .integrators import INTERRUPT_CHECK_STEPS, MAX_STEPS, Integrator, RawSolution
from .sampled_loop import CalledController, DriverTable, SampledLoop, are_called, max_capacity

BUFFERS = ("new_ends", "new_values", "new_slopes", "times", "rows")
"""The arguments of the kernel that take the segments of all inputs, and the rows of the run."""
FIRST_SEGMENTS = 4096
"""Segments and rows that the buffers of driven inputs hold at first."""
_PAUSED = Status.PAUSED.value
_WAITING = Progress.WAITING.value
_INTERVAL = Progress.INTERVAL.value


class CompiledLoop:
    """A prepared loop with the data that all its runs share; `law` is None for a controller that is
    called.
    """

    def __init__(self, compiled: CompiledSystem, prepared: SampledLoop) -> None:
        loop = prepared.loop
        known = compiled.description
        controller = loop.controller
        self.prepared, self.law = (
            prepared,
            (controller if isinstance(controller, ControlLaw) else None),
        )
        self._function = compiled_sample(self.law) if self.law is not None else None
        self.parameters = parameters_of(self.law) if self.law is not None else np.zeros(1)
        self.called_drivers = bool(loop.drivers) and are_called(prepared)
        pieces = int(np.diff(prepared.first_segments).max())
        self.capacity = (
            pieces if self.called_drivers else max_capacity(prepared) if loop.drivers else 0
        )
        columns = (*known.state_names, *known.output_names)
        measured_at = np.array(
            [columns.index(name) for name in controller.measured_columns], dtype=np.int64
        )
        commanded_at = np.array(prepared.commanded, dtype=np.int64)
        limits = np.array(
            [prepared.ranges[name] for name in controller.inputs], dtype=float
        ).reshape(-1, 2)
        self.edges = edges = prepared.instants
        self.arguments: dict[str, Any] = {
            "outputs": compiled.address["outputs"],
            "measured_at": measured_at,
            "sample": 0 if self._function is None else self._function.address,
            "period": np.array([loop.sample_time]),
            "low": np.ascontiguousarray(limits[:, 0]),
            "high": np.ascontiguousarray(limits[:, 1]),
            "commanded_at": commanded_at,
            "edges": edges,
            "ulps": np.spacing(np.abs(edges)),
            "first_sample": 0 if prepared.sampled else 1,
            "setpoints": prepared.setpoint_values,
            "first": prepared.first_segments,
            "grid": prepared.times,
            "grid_row": prepared.first_rows,
        }
        """The arguments of the kernel that are the same in all runs, by name."""


class CompiledRun:
    """A run of a compiled loop; with a control law, the results are those of the same controller
    called to rounding.

    compiled       the plant, whose structure is that of the loop's plant
    initial_state  (n,)
    parameters     of the control law (P,), an array of this run; those of the loop's controller
                   unless given
    """

    def __init__(
        self,
        loop: CompiledLoop,
        compiled: CompiledSystem,
        integrator: Integrator,
        initial_state: Array,
        control_state: ControlLoopState,
        parameters: Array | None = None,
    ) -> None:
        self.loop = loop
        self.prepared = loop.prepared
        self._integrator = integrator
        self._precomputed = compiled.precomputed
        self.bound = integrator.bind(compiled)
        self._drivers = DriverTable(
            loop.prepared, control_state, loop.capacity, loop.called_drivers
        )
        self._make_arrays(compiled.sizes.states, compiled.sizes.inputs)
        self._parameters = loop.parameters.copy() if parameters is None else parameters
        self._kernel = kernel.sampled_loop.bind(**self._arguments(compiled, self._parameters))
        self._controller = None if loop.law is not None else CalledController(loop.prepared)
        self._begin(initial_state, control_state)

    def restart(
        self,
        compiled: CompiledSystem,
        initial_state: Array,
        parameters: Array,
        control_state: ControlLoopState | None = None,
    ) -> None:
        """Begin again in the same arrays, with a plant of the same structure and other parameters;
        arguments as before.

        `control_state` is by default that of the first time; another one differs from it in the
        controller's memory alone. Everything that was returned by this run is overwritten.
        """
        self.bound.rebind(self._integrator.binding(compiled))
        self._precomputed[:] = compiled.precomputed
        self._parameters[:] = parameters
        self._kernel.replace("budget", INTERRUPT_CHECK_STEPS)
        self._drivers.restart()
        self._begin(initial_state, control_state or self._begin_state)

    def _begin(self, initial_state: Array, state: ControlLoopState) -> None:
        """Write what the kernel finds at the beginning; no sample has been taken yet."""
        law = self.loop.law
        self._begin_state = state
        self.bound.state[:] = self.state[:] = initial_state
        self.bound.count[:] = 0
        self.progress.fill(0)
        self._memory[:] = (
            [state.controller[name] for name in law.initial_memory] if law is not None else []
        )
        self._measured[:] = state.measured
        self._command[:] = state.commanded
        self._applied[:] = self._kept_inputs[:] = (
            state.applied_inputs or self.prepared.inputs.values[0]
        )
        self._memories = [state.controller] * 2
        self._called_at = -1
        self.status, self.stopped_at = Status.DONE, float(self.loop.edges[0])

    def _make_arrays(self, n: int, m: int) -> None:
        prepared = self.prepared
        controller = self.prepared.loop.controller
        law = self.loop.law
        inputs = prepared.inputs
        intervals = self.loop.edges.size - 1
        self.progress = np.zeros(len(Progress), dtype=np.int64)
        self._memory = np.empty((2, 0 if law is None else len(law.initial_memory)))
        self._measured = np.empty(len(controller.measured_columns))
        self._command = np.empty(len(controller.inputs))
        self._views = flat_view(self._measured), flat_view(self._command)
        self._applied = np.empty(m)
        self._kept_inputs = np.empty(m)
        self.state = np.empty(n)
        """The state (n,) at the end of the last completed interval."""
        self._samples = np.empty((intervals, self._measured.size))
        self._commands = np.empty((intervals, self._command.size))
        self._inputs = inputs.ends, inputs.values.copy(), inputs.slopes
        self._segments: Any = self._inputs
        self._times = prepared.times
        if self._drivers.kinds.size:
            changes = self.loop.capacity * m
            segments = FIRST_SEGMENTS + changes
            table = (segments, m)
            self._segments = np.empty(segments), np.empty(table), np.empty(table)
            self._times = np.empty(FIRST_SEGMENTS + 2 * changes)
        self._rows = np.empty((self._times.size, n))

    def _arguments(self, compiled: CompiledSystem, parameters: Array) -> dict[str, Any]:
        """All arguments of the kernel, by name."""
        bound = self.bound
        drivers = self._drivers
        ends, values, slopes = self._inputs
        new_ends, new_values, new_slopes = self._segments
        return {
            **self.loop.arguments,
            "integrate": bound.entry_address or 0,
            "slots": bound.slots,
            "places": bound.places,
            "clock": bound.clock,
            "count": bound.count,
            "y": bound.state,
            "c": compiled.precomputed,
            "o": np.empty(max(compiled.sizes.outputs, 1)),
            "parameters": parameters,
            "ends": ends,
            "values": values,
            "slopes": slopes,
            "kinds": drivers.kinds,
            "settings": drivers.settings,
            "states": drivers.states,
            "columns": drivers.columns,
            "counts": drivers.counts,
            "scratch": drivers.scratch,
            "begins": drivers.begins,
            "bounds": compiled.description.lower_bounds,
            "applied": self._applied,
            "memory": self._memory,
            "measured": self._measured,
            "command": self._command,
            "kept": self.state,
            "kept_applied": self._kept_inputs,
            "kept_states": drivers.kept,
            "new_ends": new_ends,
            "new_values": new_values,
            "new_slopes": new_slopes,
            "times": self._times,
            "rows": self._rows,
            "samples": self._samples,
            "commands": self._commands,
            "progress": self.progress,
            "budget": INTERRUPT_CHECK_STEPS,
        }

    def integrate(self) -> None:
        """Run the loop until its end, or until an interval fails or the user stops it."""
        run = self._kernel.runner
        flags = flat_view(self.progress)
        try:
            status = run()
            while status == _PAUSED:
                if flags[_WAITING]:
                    self._answer(flags[_WAITING], flags[_INTERVAL])
                elif flags[Progress.FULL]:
                    self._extend()
                elif self._takes_too_many_steps():
                    break
                status = run()
        except KeyboardInterrupt:
            status = Status.INTERRUPTED
        self.status = Status.TOO_MANY_STEPS if status == Status.PAUSED else Status(status)
        if self.progress[Progress.SAMPLES]:
            self.stopped_at = float(self.bound.clock[0])
        if self.status == Status.INTERRUPTED:
            self._discard_interval()

    def _takes_too_many_steps(self) -> bool:
        running = self.progress[Progress.RUNNING]
        return bool(
            running and self.bound.count[2] - self.progress[Progress.STEPS_BEFORE] >= MAX_STEPS
        )

    def _answer(self, waiting: int, interval: int) -> None:
        """Give the kernel what it awaits."""
        if waiting == Waiting.COMMANDS:
            measured, command = self._views
            memories = self._memories
            memories[0] = memories[1]
            assert self._controller is not None
            commands, memories[1] = self._controller.step(memories[0], measured.tolist(), interval)
            self._called_at = interval
            for i, value in enumerate(commands):
                command[i] = value
        elif waiting == Waiting.DRIVERS:
            first_rows = self.prepared.first_rows
            progress = self.progress
            drivers = self._drivers
            count = drivers.call(interval, float(self.loop.edges[interval]))
            self._kernel.replace("columns", drivers.columns)
            segments = progress[Progress.SEGMENTS] + count
            rows = (
                progress[Progress.ROWS]
                + count
                + int(first_rows[interval + 1] - first_rows[interval])
            )
            while segments > len(self._segments[0]) or rows > len(self._times):
                self._extend()
        else:  # the integrator has no machine code that a kernel could call
            self.progress[Progress.RESULT] = self.bound.run_part().value

    def _extend(self) -> None:
        """Longer buffers for the segments and rows of driven inputs."""
        buffers = [
            np.concatenate([buffer, np.empty_like(buffer)])
            for buffer in (*self._segments, self._times, self._rows)
        ]
        *self._segments, self._times, self._rows = buffers
        for name, array in zip(BUFFERS, buffers, strict=True):
            self._kernel.replace(name, array)
        self.progress[Progress.FULL] = 0

    def _discard_interval(self) -> None:
        """Forget an interval that was interrupted, so that the run can be continued from its
        beginning.
        """
        progress = self.progress
        if progress[Progress.RUNNING]:
            progress[Progress.SEGMENTS] = progress[Progress.FIRST_SEGMENT]
            progress[Progress.ROWS] = progress[Progress.FIRST_ROW]
        progress[Progress.SAMPLES] = progress[Progress.INTERVAL]
        self.stopped_at = self.time
        self.bound.state[:] = self.state

    @property
    def time(self) -> float:
        """The end of the last completed interval [s]."""
        return float(self.loop.edges[self.progress[Progress.INTERVAL]])

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
        """The segments of all inputs of the intervals that have begun; without any, one of
        zeros.
        """
        count = int(self.progress[Progress.SEGMENTS])
        if not count:
            none = np.zeros((1, self._applied.size))
            return PiecewiseLinear(self.loop.edges[-1:], none, none)
        return PiecewiseLinear(*(array[:count] for array in self._segments))

    @property
    def rows(self) -> tuple[Array, Array]:
        """Times (N,) and states (N, n) of the rows that were reached."""
        count = int(self.progress[Progress.ROWS])
        return self._times[:count], self._rows[:count]

    def columns(self, intervals: npt.NDArray[np.int64], setpoints: Array) -> dict[str, Array]:
        """Set points (R, s), and measurements and commands of the last sample, at rows in these
        intervals (R,).
        """
        intervals = np.minimum(intervals, max(len(self.measured) - 1, 0))
        measured, commanded = (
            values.take(intervals, axis=0) for values in (self.measured, self.commanded)
        )
        columns = *setpoints.T, *measured.T, *commanded.T
        return dict(zip(self.prepared.loop.column_names, columns, strict=True))

    def raw(self, rows: Array) -> RawSolution:
        """The result of the integrator, of which these rows (N, n) are taken."""
        state = self.bound.state.copy() if len(self.measured) else self.state
        return RawSolution(
            rows, len(rows), self.stopped_at, state, self.status, *self.bound.count[2:].tolist()
        )

    @property
    def control_state(self) -> ControlLoopState:
        """The state of the loop at the end of the last completed interval."""
        done = int(self.progress[Progress.INTERVAL])
        begun = self._begin_state
        if not done:
            return begun
        # the last sample of a controller that is called may be that of an interval that was not
        # completed
        memory = self._memories[1 if done > self._called_at else 0]
        law = self.loop.law
        if law is not None:
            memory = dict(zip(law.initial_memory, self._memory[0].tolist(), strict=True))
        return ControlLoopState(
            controller=memory,
            origin=begun.origin,
            time=self.time,
            sample_count=begun.sample_count + done - (0 if self.prepared.sampled else 1),
            measured=tuple(self._samples[done - 1].tolist()),
            commanded=tuple(self._commands[done - 1].tolist()),
            applied_inputs=tuple(self._kept_inputs.tolist()),
            drivers=self._drivers.as_mapping(done),
        )
