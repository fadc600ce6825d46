"""A loop at a plant for one run: all that does not change from sample to sample, made once."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..compile import System
from ..control.control_loop import ControlLoop, ControlLoopState
from ..control.driver import WithDrivers
from ..control.inputs import PiecewiseLinear
from ..core.arrays import Array
from ..core.errors import ParameterError
from ..plant.plant import Plant
from ..plant.state import state_lower_bounds
from .arguments import check_input_range, output_times
from .integrators import Integrator, Stepper

if TYPE_CHECKING:
    from ..compile.program import CompiledSystem

MOST_SAMPLES = 10_000_000
"""Samples of one run that fit a usual memory."""
NEAR = 1e-9
"""Share of a period within which two instants are one: rounding parts 3 * 0.1 from 0.3."""


def columns_of(ready: CompiledSystem) -> tuple[str, ...]:
    """What a controller can measure at a system: its states and outputs."""
    return (*(s.name for s in ready.system.states), *ready.output_names)


def ranges_of(plant: System, loop: ControlLoop) -> dict[str, tuple[float, float]]:
    """The least and greatest command of every input that the controller commands."""
    declared = {i.name: (i.minimum, i.maximum) for i in plant.commands} if isinstance(plant, Plant) else {}
    of_driver = dict.fromkeys(loop.drivers, (0.0, 1.0))
    return {name: ({**declared, **of_driver}).get(name, (-math.inf, math.inf)) for name in loop.controller.inputs}


@dataclasses.dataclass(frozen=True, eq=False)
class SampledLoop:
    """A loop at a plant for one run.

    edges    (K + 1,) the beginnings of the pieces between samples, and the end of the run
    sampled  whether the first piece begins with a sample: a run that was cut between two does not
    course   what the inputs are told, cut at the edges; those that are commanded are filled in as the run goes.
             Piece k of it begins at place firsts[k]
    times    rows; those of piece k begin at place cuts[k], and what drivers do adds instants
    """

    loop: ControlLoop
    stepper: Stepper
    driven: WithDrivers
    inputs: tuple[str, ...]
    places: list[int]
    ranges: Mapping[str, tuple[float, float]]
    measure: Callable[[Array, Array], dict[str, float]]
    inputs_in_time: PiecewiseLinear
    segment_offsets: list[int]
    setpoint: PiecewiseLinear
    start: float
    edges: Array
    sampled: bool
    times: Array
    row_offsets: list[int]
    lower_bounds: Array

    def before(self) -> Array:
        """The inputs before the first sample: those beside the controller as they begin, the others at zero."""
        return np.array(self.inputs_in_time.values[0])

    def told(self, k: int, commands: tuple[float, ...]) -> PiecewiseLinear:
        """Piece k of the course with these commands held, before any driver."""
        piece = slice(self.segment_offsets[k], self.segment_offsets[k + 1])
        self.inputs_in_time.values[piece, self.places] = commands
        return PiecewiseLinear(
            self.inputs_in_time.ends[piece], self.inputs_in_time.values[piece], self.inputs_in_time.slopes[piece]
        )


def prepare_loop(
    ready: CompiledSystem, loop: ControlLoop, memory: ControlLoopState, start: float, duration: float, method: Integrator,
    output: float | npt.ArrayLike | None,
) -> SampledLoop:  # fmt: skip
    plant, inputs = ready.system, ready.system.inputs
    edges, sampled = _edges(loop.period, memory, start, start + duration)
    driven = WithDrivers(loop.other_inputs, loop.drivers)
    shown = driven.segments(inputs, start, duration)
    shown.check_shape(len(inputs), start)
    check_input_range(plant, shown, start)
    near = NEAR * loop.period
    places = [inputs.index(name) for name in loop.controller.inputs]
    beside = _snapped(loop.other_inputs.segments(inputs, start, duration), edges, near)
    starts = np.unique(np.concatenate([edges[:-1], beside.starts(start)]))
    course = beside.cut_at(starts, start)
    course.values[:, places] = course.slopes[:, places] = 0.0
    firsts = np.append(np.searchsorted(starts, edges[:-1]), starts.size)
    times = output_times(output, start, duration, np.append(start, course.ends))
    setpoint = _snapped(loop.setpoint.segments(loop.controller.setpoints, start, duration), edges, near)
    cuts = np.searchsorted(times, edges, side="right")
    return SampledLoop(
        loop, method.stepper(ready), driven, inputs, places, ranges_of(plant, loop), _looking(ready, loop), course,
        firsts.tolist(), setpoint, start, edges, sampled, times, [0, *cuts[1:].tolist()], state_lower_bounds(plant),
    )  # fmt: skip


def _edges(period: float, memory: ControlLoopState, start: float, end: float) -> tuple[Array, bool]:
    """Start, the sampling instants after it, and end of a run [s]; whether the start is a sampling instant itself."""
    count, near = (end - memory.origin) / period - memory.sample_count, NEAR * period
    if count > MOST_SAMPLES:
        raise ParameterError(
            f"a period of {period:g} s makes {count:.3g} samples; {MOST_SAMPLES} are allowed. Lengthen it, or simulate "
            "a shorter time."
        )
    instants = memory.origin + period * (memory.sample_count + np.arange(max(math.ceil(count), 0) + 1))
    if abs(start - memory.time) > near:
        raise ParameterError(
            f"the memory of the loop is of {memory.time:.10g} s, and the run begins at {start:.10g} s. Give the time "
            "that was returned with it."
        )
    within = instants[(instants > start + near) & (instants < end - near)]
    return np.concatenate([[start], within, [end]]), bool(instants[0] <= start + near)


def _snapped(segments: PiecewiseLinear, edges: Array, near: float) -> PiecewiseLinear:
    """The segments, an end that is next to a sampling instant moved to it."""
    behind = np.clip(np.searchsorted(edges, segments.ends), 1, edges.size - 1)
    before, after = edges[behind - 1], edges[behind]
    nearest = np.where(segments.ends - before < after - segments.ends, before, after)
    ends = np.where(np.abs(nearest - segments.ends) <= near, nearest, segments.ends)
    kept = np.diff(ends, prepend=edges[0]) > 0
    return PiecewiseLinear(ends[kept], segments.values[kept], segments.slopes[kept])


def _looking(ready: CompiledSystem, loop: ControlLoop) -> Callable[[Array, Array], dict[str, float]]:
    """A function of state (n,) and inputs (m,) that gives the measured columns by name."""
    names, states = loop.controller.measured_columns, [s.name for s in ready.system.states]
    if all(name in states for name in names):
        places = [(name, states.index(name)) for name in names]
        return lambda state, had: {name: float(state[i]) for name, i in places}
    from ..compile.cache.kernel import evaluate

    known, results = columns_of(ready), np.empty((1, ready.sizes.outputs))
    wanted, outputs = [(name, known.index(name)) for name in names], ready.address["outputs"]

    def look(state: Array, had: Array) -> dict[str, float]:
        evaluate(outputs, ready.precomputed, state.reshape(1, -1), had.reshape(1, -1), results)
        values = state.tolist() + results[0].tolist()
        return {name: values[i] for name, i in wanted}

    return look
