"""Simulation of a control loop: from one sampling instant to the next, each met exactly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..control.control_loop import COMMAND, MEASURED, SETPOINT, ControlLoop, ControlLoopState
from ..control.controller import Measurement
from ..control.piecewise_linear import PiecewiseLinear
from ..control.with_drivers import WithDrivers
from ..core.arrays import Array, flat_view
from ..core.diagnostics import Diagnostic, DiagnosticCode
from ..core.errors import ParameterError
from ..core.status import Status
from ..plant.units import column_units
from .bound_integrator import RawSolution
from .compiled_loop import CompiledLoop, CompiledRun, can_be_compiled
from .intervals import DrivenIntervals, HeldIntervals, Intervals
from .kept_loops import form_of, keep_run, kept_run
from .problem import Problem
from .rows import make_recording, recorded_rows, truncate_at_invalid_row
from .sampled_loop import SampledLoop, intervals_of, make_measurement, prepare_loop
from .solution import Solution, Statistics


def solve_closed_loop(problem: Problem) -> Solution:
    """The solution of a problem with a ControlLoop, and the state from which the run can be continued.

    The recording also has `setpoint.`, `measured.` and `command.` columns: the set points in time, and the controller's
    measurements and commands at the last sample. Every sampling instant is a row. Measurements are taken just before
    the command of the same instant: an output that jumps with an input has not jumped yet. Split at a sampling instant
    and continued, a run equals the run in one, to the last bit; split between two, to the integrator's tolerance.
    """
    loop, form = problem.input, form_of(problem)
    control_state = problem.control_state or loop.init(problem.start_time)  # type: ignore[union-attr]
    run: CompiledRun | CalledRun | None = kept_run(problem, form, control_state)
    if run is None:
        run = start_run(problem, prepare_loop(problem, control_state), control_state)
    run.integrate()
    solution = _solution(problem, run)
    if form is not None and isinstance(run, CompiledRun) and run.status == Status.DONE:
        keep_run(problem, form, run)
    return solution


def start_run(problem: Problem, prepared: SampledLoop, control_state: ControlLoopState) -> CompiledRun | CalledRun:
    """A run of the loop as one program where it can be compiled, else one that calls the controller at each sample."""
    assert problem.integrator is not None
    if can_be_compiled(prepared):
        loop = CompiledLoop(problem.compiled, prepared)
        run = CompiledRun(loop, problem.compiled, problem.integrator, problem.initial_vector, control_state)
        if run.can_run:
            return run
    return CalledRun(problem, prepared, control_state)


_Sample = tuple[Any, tuple[float, ...], tuple[float, ...], Status]
"""The memory of a controller, its measurements and commands, and whether these can be applied."""


class CalledRun:
    """A run of a loop whose controller is called at each sample: the intervals so far, and the state at the end of the
    last complete one."""

    def __init__(self, problem: Problem, prepared: SampledLoop, control_state: ControlLoopState) -> None:
        self.prepared, self._last = prepared, tuple(control_state)
        compiled, integrator, loop = problem.compiled, problem.integrator, prepared.loop
        assert integrator is not None
        self.bound = integrator.bind(compiled)
        self.bound.state[:] = problem.initial_vector
        states, chains = compiled.sizes.states, WithDrivers(loop.other_inputs, loop.drivers).chains
        self.intervals: Intervals = (
            DrivenIntervals(prepared, states, chains) if chains else HeldIntervals(prepared, states)
        )
        self.samples: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
        self.status, self.time = Status.DONE, problem.start_time
        self.state = self.bound.state.copy()
        self.stopped_at = problem.start_time
        self._measure = make_measurement(compiled, loop, self.bound.state)
        self._measured_names, self._setpoint_names = loop.controller.measured_columns, loop.controller.setpoints
        self._ranges = [(name, low, high) for name, (low, high) in prepared.ranges.items()]
        self._setpoints: tuple[list[float], dict[str, float]] = [], {}

    @property
    def signal(self) -> PiecewiseLinear:
        """The segments of all inputs of the intervals that have begun."""
        return self.intervals.signal

    @property
    def rows(self) -> tuple[Array, Array]:
        """Times (N,) and states (N, n) of the rows that were reached."""
        return self.intervals.rows

    @property
    def measured(self) -> Array:
        """Measurements (K, columns) of every interval that has begun."""
        return self._sampled(0, len(self._measured_names))

    @property
    def commanded(self) -> Array:
        """Commands (K, inputs) of every interval that has begun."""
        return self._sampled(1, len(self._ranges))

    def _sampled(self, kind: int, width: int) -> Array:
        return np.array([sample[kind] for sample in self.samples], dtype=float).reshape(len(self.samples), width)

    def integrate(self) -> None:
        """Sample and integrate from edge to edge, until the end or until an interval fails."""
        prepared, bound, intervals, samples = self.prepared, self.bound, self.intervals, self.samples
        edges, view, kept = prepared.edges, flat_view(bound.state), flat_view(self.state)
        memory, origin, _, count, measured, commanded, applied, drivers = self._last
        applied = applied or tuple(prepared.inputs.values[0].tolist())
        for k, end in enumerate(edges[1:]):
            try:
                if k or prepared.sampled:
                    memory, measured, commanded, self.status = self._sample(memory, applied, prepared.setpoints[k])
                    if self.status:
                        return
                    count += 1
                begin = edges[k]
                drivers = intervals.append(k, commanded, drivers)
                self.status, self.stopped_at = intervals.integrate(bound, begin)
                if self.status is Status.DONE:
                    for i, limit in prepared.lower_bounds:
                        if view[i] < limit:
                            self.status = Status.NEGATIVE_AIR_MASS
                    applied = tuple(intervals.final_inputs(begin, end))
            except KeyboardInterrupt:
                intervals.discard()
                self.stopped_at, bound.state[:] = self.time, self.state
                self.status = Status.INTERRUPTED
                return
            samples.append((measured, commanded))
            intervals.keep()
            if self.status:
                return
            self.time, kept[:] = end, view
            self._last = memory, origin, end, count, measured, commanded, applied, drivers

    @property
    def control_state(self) -> ControlLoopState:
        """The state of the loop at the end of the last complete interval."""
        return ControlLoopState(*self._last)

    def _sample(self, memory: Any, applied: tuple[float, ...], setpoints: list[float]) -> _Sample:
        """The controller's memory after a sample, measurements, new commands, and whether they can be applied."""
        loop = self.prepared.loop
        measured = tuple(self._measure(applied))
        if not all(map(math.isfinite, measured)):
            return memory, measured, (), Status.NOT_FINITE
        if setpoints != self._setpoints[0]:
            self._setpoints = setpoints, dict(zip(self._setpoint_names, setpoints, strict=True))
        columns = dict(zip(self._measured_names, measured, strict=True))
        measurement = Measurement(columns, self._setpoints[1], self.prepared.ranges)
        commands, memory = loop.controller.step(memory, measurement, loop.sample_time)
        try:
            wanted = [(0.0 + commands[name], low, high) for name, low, high in self._ranges]
            commanded = tuple([low if low > v else high if high < v else v for v, low, high in wanted])
        except (KeyError, TypeError, ValueError):
            controller = loop.controller
            raise ParameterError(
                f"{type(controller).__name__} commands {commands!r}; it must give a number for each of "
                f"{', '.join(controller.inputs)}."
            ) from None
        finite = all(map(math.isfinite, commanded))
        return memory, measured, commanded, Status.DONE if finite else Status.NON_FINITE_COMMAND


def _solution(problem: Problem, run: CompiledRun | CalledRun) -> Solution:
    """The rows of all intervals as one solution."""
    compiled, loop, integrator = problem.compiled, problem.input, problem.integrator
    assert isinstance(loop, ControlLoop)
    segments, (times, states) = run.signal, run.rows
    if isinstance(run, CompiledRun):  # the next run may be in the same arrays
        times, states = times.copy(), states.copy()
    begun = len(run.measured) > 0
    at, state = (run.stopped_at, run.bound.state.copy()) if begun else (run.time, run.state)
    raw = RawSolution(states, times.size, at, state, run.status, *run.bound.step_counts)
    if not segments.ends.size:  # the run ended before its first interval
        shape = (1, compiled.sizes.inputs)
        segments = PiecewiseLinear(np.array([problem.end_time]), np.zeros(shape), np.zeros(shape))
    table = recorded_rows(compiled, states, times, segments, problem.start_time)
    raw, table = truncate_at_invalid_row(compiled, raw, table, times)
    units = column_units(problem.system, compiled.output_names)
    way = "compiled with the plant" if isinstance(run, CompiledRun) else "called from Python at each sample"
    note = f"controlled by {loop.describe(units)}; {way}"
    remark = Diagnostic(DiagnosticCode.CONTROLLER, type(loop.controller).__name__, note)
    notes = loop.controller.notes(run.control_state.controller)
    remarks = (remark, *(Diagnostic(DiagnosticCode.CONTROLLER, remark.subject, text) for text in notes))
    more = _controller_columns(problem, run, times[: raw.reached])
    recording, diagnostics = make_recording(compiled, raw, table, times, integrator, problem.end_time, more, remarks)
    final = dict(zip(compiled.description.state_names, run.state.tolist(), strict=True))
    statistics = Statistics(raw.steps, raw.rejected)
    return Solution(problem, recording, raw.status, statistics, diagnostics, run.time, final, run.control_state)


def _controller_columns(problem: Problem, run: CompiledRun | CalledRun, times: Array) -> dict[str, Array]:
    """Set points in time; measurements and commands of the last sample at every row."""
    prepared, controller = run.prepared, run.prepared.loop.controller
    intervals = np.minimum(intervals_of(times, prepared.instants), max(len(run.measured) - 1, 0))
    setpoints, _ = prepared.setpoint_signal.at_rising(times, problem.start_time)
    measured, commanded = (values.take(intervals, axis=0) for values in (run.measured, run.commanded))
    columns: dict[str, Array] = {}
    for values, prefix, names in (
        (setpoints, SETPOINT, controller.setpoints), (measured, MEASURED, controller.measured_columns),
        (commanded, COMMAND, controller.inputs),
    ):  # fmt: skip
        columns |= {f"{prefix}{name}": column for name, column in zip(names, values.T, strict=True)}
    return columns
