"""Run of a control loop from Python: for drivers that no kernel implements, and where there is no machine code."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np

from ...core.arrays import Array, flat_view
from ...core.status import Status
from ..loop.control_loop import ControlLoopState
from ..loop.piecewise_linear import PiecewiseLinear
from ..loop.with_drivers import WithDrivers
from .called_controller import CalledController
from .intervals import Intervals
from .problem import Problem
from .sampled_loop import SampledLoop, make_measurement

_Sample = tuple[Any, tuple[float, ...], tuple[float, ...], Status]
"""The memory of a controller, its measurements and commands, and whether these can be applied."""


class CalledRun:
    """A run of a loop whose controller and drivers are called at each sample: the intervals so far, and the state at
    the end of the last complete one."""

    def __init__(self, problem: Problem, prepared: SampledLoop, control_state: ControlLoopState) -> None:
        self.prepared, self._last = prepared, tuple(control_state)
        compiled, integrator, loop = problem.compiled, problem.integrator, prepared.loop
        assert integrator is not None
        self.bound = integrator.bind(compiled)
        self.bound.state[:] = problem.initial_vector
        self.intervals = Intervals(prepared, compiled.sizes.states, WithDrivers(loop.other_inputs, loop.drivers).chains)
        self.samples: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
        self.status, self.time = Status.DONE, problem.start_time
        self.state = self.bound.state.copy()
        self.stopped_at = problem.start_time
        self._measure = make_measurement(compiled, loop, self.bound.state)
        self._lower_bounds = compiled.description.lower_bounds.tolist()
        self._controller, self._limits = CalledController(prepared), list(prepared.ranges.values())

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
        return self._sampled(0, len(self.prepared.loop.controller.measured_columns))

    @property
    def commanded(self) -> Array:
        """Commands (K, inputs) of every interval that has begun."""
        return self._sampled(1, len(self._limits))

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
                    memory, measured, commanded, self.status = self._sample(memory, applied, k)
                    if self.status:
                        return
                    count += 1
                begin = edges[k]
                drivers = intervals.append(k, commanded, drivers)
                self.status, self.stopped_at = intervals.integrate(bound, begin)
                if self.status is Status.DONE:
                    if any(map(operator.lt, view, self._lower_bounds)):
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

    def _sample(self, memory: Any, applied: tuple[float, ...], interval: int) -> _Sample:
        """The controller's memory after a sample, measurements, new commands, and whether they can be applied."""
        measured = tuple(self._measure(applied))
        if not all(map(math.isfinite, measured)):
            return memory, measured, (), Status.NOT_FINITE
        wanted, memory = self._controller.step(memory, measured, interval)
        limited = zip(wanted, self._limits, strict=True)
        commanded = tuple([low if low > v else high if high < v else v for v, (low, high) in limited])
        finite = all(map(math.isfinite, commanded))
        return memory, measured, commanded, Status.DONE if finite else Status.NON_FINITE_COMMAND
