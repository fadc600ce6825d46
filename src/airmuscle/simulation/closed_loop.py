"""Simulation of a control loop: from one sampling instant to the next, each met exactly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..control.control_loop import COMMAND, MEASURED, SETPOINT, ControlLoopState
from ..control.controller import Measurement
from ..control.driver import Driver
from ..control.piecewise_linear import PiecewiseLinear, merge_columns
from ..control.with_drivers import WithDrivers, apply_drivers
from ..core.arrays import Array
from ..core.diagnostics import Diagnostic, DiagnosticCode
from ..core.errors import ParameterError
from ..core.status import Status
from ..plant.units import column_units
from .buffers import Buffer
from .compiled_loop import CompiledLoop, CompiledRun, can_be_compiled
from .integrators import RawSolution
from .output_times import merge_output_times
from .problem import Problem
from .rows import evaluate_rows, make_recording, truncate_at_invalid_row
from .sampled_loop import SampledLoop, prepare_loop
from .solution import Solution, Statistics


def solve_closed_loop(problem: Problem) -> Solution:
    """The solution of a problem with a ControlLoop, and the state from which the run can be continued.

    The recording also has `setpoint.`, `measured.` and `command.` columns: the set points in time, and the controller's
    measurements and commands at the last sample. Every sampling instant is a row. Measurements are taken just before
    the command of the same instant: an output that jumps with an input has not jumped yet. Split at a sampling instant
    and continued, a run equals the run in one, to the last bit; split between two, to the integrator's tolerance.
    """
    loop = problem.input
    control_state = problem.control_state or loop.init(problem.start_time)  # type: ignore[union-attr]
    run = start_run(problem, prepare_loop(problem, control_state), control_state)
    run.integrate()
    return _solution(problem, run)


def start_run(problem: Problem, prepared: SampledLoop, control_state: ControlLoopState) -> CompiledRun | CalledRun:
    """A run of the loop as one program where it can be compiled, else one that calls the controller at each sample."""
    assert problem.integrator is not None
    if can_be_compiled(prepared):
        loop = CompiledLoop(problem.compiled, prepared)
        run = CompiledRun(loop, problem.compiled, problem.integrator, problem.initial_vector, control_state)
        if run.can_run:
            return run
    return CalledRun(problem, prepared, control_state)


class CalledRun:
    """A run of a loop whose controller is called at each sample."""

    def __init__(self, problem: Problem, prepared: SampledLoop, control_state: ControlLoopState) -> None:
        self.problem, self.prepared, self.control_state = problem, prepared, control_state
        compiled, integrator = problem.compiled, problem.integrator
        assert integrator is not None
        self.bound = integrator.bind(compiled)
        self.bound.state[:] = problem.initial_vector
        n, m = compiled.sizes.states, compiled.sizes.inputs
        segments = prepared.inputs.ends.size
        self.ends, self.values, self.slopes = Buffer(None, segments), Buffer(m, segments), Buffer(m, segments)
        self.times, self.states = Buffer(None, prepared.times.size), Buffer(n, prepared.times.size)
        self.samples: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
        self.applied = np.array(control_state.applied_inputs or prepared.inputs.values[0])
        self.status, self.time = Status.DONE, problem.start_time
        self.state = self.bound.state.copy()
        self.stopped_at = problem.start_time
        self.kept_segments = 0
        loop = prepared.loop
        self.chains: dict[str, tuple[Driver, ...]] = WithDrivers(loop.other_inputs, loop.drivers).chains
        self.driven = {name: compiled.description.input_names.index(name) for name in self.chains}

    @property
    def signal(self) -> PiecewiseLinear:
        """The segments of all inputs of the intervals that have begun."""
        return PiecewiseLinear(self.ends.rows, self.values.rows, self.slopes.rows)

    @property
    def rows(self) -> tuple[Array, Array]:
        """Times (N,) and states (N, n) of the rows that were reached."""
        return self.times.rows, self.states.rows

    @property
    def measured(self) -> Array:
        """Measurements (K, columns) of every interval that has begun."""
        return self._sampled(0, len(self.prepared.loop.controller.measured_columns))

    @property
    def commanded(self) -> Array:
        """Commands (K, inputs) of every interval that has begun."""
        return self._sampled(1, len(self.prepared.loop.controller.inputs))

    def _sampled(self, kind: int, width: int) -> Array:
        return np.array([sample[kind] for sample in self.samples], dtype=float).reshape(-1, width)

    def integrate(self) -> None:
        """Sample and integrate from edge to edge, until the end or until an interval fails."""
        prepared, edges = self.prepared, self.prepared.edges
        for k in range(len(edges) - 1):
            try:
                state = self.control_state
                if k or prepared.sampled:
                    state, self.status = self._sample(state, prepared.setpoints[k])
                    if self.status:
                        return
                state = self._integrate_interval(state, k)
            except KeyboardInterrupt:
                self._discard_interval()
                self.status = Status.INTERRUPTED
                return
            self.samples.append((state.measured, state.commanded))
            self.kept_segments = self.ends.size
            if self.status:
                return
            self.time, self.state[:] = edges[k + 1], self.bound.state
            self.control_state = state._replace(time=edges[k + 1], applied_inputs=tuple(self.applied.tolist()))

    def _sample(self, state: ControlLoopState, setpoints: list[float]) -> tuple[ControlLoopState, Status]:
        """The state after a sample, with the new commands; and whether they can be applied."""
        prepared, loop = self.prepared, self.prepared.loop
        controller = loop.controller
        columns = prepared.measure(self.bound.state, self.applied)
        measured = tuple(columns.values())
        if not all(map(math.isfinite, measured)):
            return state, Status.NOT_FINITE
        measurement = Measurement(columns, dict(zip(controller.setpoints, setpoints, strict=True)), prepared.ranges)
        commands, memory = controller.step(state.controller, measurement, loop.sample_time)
        try:
            commanded = tuple(
                [min(max(0.0 + commands[name], low), high) for name, (low, high) in prepared.ranges.items()]
            )
        except (KeyError, TypeError, ValueError):
            raise ParameterError(
                f"{type(controller).__name__} commands {commands!r}; it must give a number for each of "
                f"{', '.join(controller.inputs)}."
            ) from None
        if not all(map(math.isfinite, commanded)):
            return state, Status.NON_FINITE_COMMAND
        count = state.sample_count + 1
        return ControlLoopState(
            memory, state.origin, state.time, count, measured, commanded, state.applied_inputs, state.drivers
        ), Status.DONE

    def _integrate_interval(self, state: ControlLoopState, k: int) -> ControlLoopState:
        """Integrate interval k under the commands of a state; the state with those of the drivers at its end."""
        prepared, begin, end = self.prepared, self.prepared.edges[k], self.prepared.edges[k + 1]
        first, last = prepared.segment_offsets[k : k + 2]
        inputs = prepared.inputs
        inputs.values[first:last, prepared.commanded] = state.commanded
        times = prepared.times[prepared.row_offsets[k] : prepared.row_offsets[k + 1]]
        ends: Any
        values: Any
        slopes: Any
        if self.chains:
            part = PiecewiseLinear(inputs.ends[first:last], inputs.values[first:last], inputs.slopes[first:last])
            columns = [part.column(i) for i in range(inputs.values.shape[1])]
            drivers = apply_drivers(self.chains, state.drivers, columns, self.driven, begin)
            ends, values, slopes = merge_columns(columns, begin)
            state = state._replace(drivers=drivers)
            if len(ends) > 1:
                times = merge_output_times(times, np.array(ends), prepared.loop.sample_time)
        else:
            ends, values, slopes = inputs.ends[first:last], inputs.values[first:last], inputs.slopes[first:last]
        self._append(ends, values, slopes, times, last - first if not self.chains else len(ends))
        self._run_interval(begin, end)
        return state

    def _append(self, ends: Any, values: Any, slopes: Any, times: Array, count: int) -> None:
        """Append the segments and the times of an interval to the buffers."""
        self.first_segment, self.first_row = self.ends.size, self.times.size
        for buffer, new in ((self.ends, ends), (self.values, values), (self.slopes, slopes)):
            buffer.reserve(count)
            target = buffer.array[buffer.size : buffer.size + count]
            target.reshape(-1)[:] = new if isinstance(new, list) else new.reshape(-1)
            buffer.size += count
        self.times.reserve(times.size)
        self.times.array[self.times.size : self.times.size + times.size] = times
        self.times.size += times.size
        self.states.reserve(times.size)

    def _discard_interval(self) -> None:
        """Forget an interval that was interrupted, so that the run can be continued from its beginning."""
        self.times.size = self.states.size
        for buffer in (self.ends, self.values, self.slopes):
            buffer.size = min(buffer.size, self.kept_segments)
        self.stopped_at, self.bound.state[:] = self.time, self.state

    def _run_interval(self, begin: float, end: float) -> None:
        """Integrate through the segments that were appended last, and fill the rows."""
        count = self.ends.size - self.first_segment
        wanted = self.times.size - self.first_row
        s, r = self.first_segment, self.first_row
        addresses = (self.ends.at(s), self.values.at(s), self.slopes.at(s))
        result = self.bound.run_part(begin, addresses, count, self.times.at(r), self.states.at(r), wanted)
        self.status, reached, self.stopped_at = result
        self.states.size = r + reached
        if reached < wanted:
            self.times.size = self.states.size
        if self.status == Status.DONE:
            state = self.bound.state
            if any(state[i] < bound for i, bound in self.prepared.lower_bounds):
                self.status = Status.NEGATIVE_AIR_MASS
            last = self.ends.size - 1
            start = float(self.ends.array[last - 1]) if count > 1 else begin
            self.applied = self.values.array[last] + self.slopes.array[last] * (end - start)


def _solution(problem: Problem, run: CompiledRun | CalledRun) -> Solution:
    """The rows of all intervals as one solution."""
    compiled, prepared, integrator = problem.compiled, run.prepared, problem.integrator
    segments, (times, states) = run.signal, run.rows
    begun = len(run.measured) > 0
    at, state = (run.stopped_at, run.bound.state.copy()) if begun else (run.time, run.state)
    raw = RawSolution(states, times.size, at, state, run.status, *run.bound.step_counts)
    if not segments.ends.size:  # the run ended before its first interval
        shape = (1, compiled.sizes.inputs)
        segments = PiecewiseLinear(np.array([problem.end_time]), np.zeros(shape), np.zeros(shape))
    table = evaluate_rows(compiled, states, times, segments, problem.start_time)
    raw, table = truncate_at_invalid_row(compiled, raw, table, times)
    units = column_units(problem.system, compiled.output_names)
    way = "compiled with the plant" if isinstance(run, CompiledRun) else "called from Python at each sample"
    note = f"controlled by {prepared.loop.describe(units)}; {way}"
    remark = Diagnostic(DiagnosticCode.CONTROLLER, type(prepared.loop.controller).__name__, note)
    more = _controller_columns(problem, run, times[: raw.reached])
    recording, diagnostics = make_recording(compiled, raw, table, times, integrator, problem.end_time, more, (remark,))
    final = dict(zip(compiled.description.state_names, run.state.tolist(), strict=True))
    statistics = Statistics(raw.steps, raw.rejected)
    return Solution(problem, recording, raw.status, statistics, diagnostics, run.time, final, run.control_state)


def _controller_columns(problem: Problem, run: CompiledRun | CalledRun, times: Array) -> dict[str, Array]:
    """Set points in time; measurements and commands of the last sample at every row."""
    prepared, controller = run.prepared, run.prepared.loop.controller
    intervals = np.searchsorted(np.array(prepared.edges), times, side="right") - 1
    intervals = np.clip(intervals, 0, max(len(run.measured) - 1, 0))
    setpoints = prepared.setpoint_signal.inputs_at(times, problem.start_time)
    columns = {f"{SETPOINT}{name}": setpoints[:, i] for i, name in enumerate(controller.setpoints)}
    kinds = ((MEASURED, controller.measured_columns), (COMMAND, controller.inputs))
    for values, (prefix, names) in zip((run.measured, run.commanded), kinds, strict=True):
        columns |= {f"{prefix}{name}": values[intervals, i] for i, name in enumerate(names)}
    return columns
