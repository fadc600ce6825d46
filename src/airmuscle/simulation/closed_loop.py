"""A plant with a controller through time: from one sampling instant to the next, each met exactly."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..compile import System
from ..control.control_loop import COMMAND, MEASURED, SETPOINT, ControlLoop, ControlLoopState
from ..control.controller import Measurement
from ..control.inputs import PiecewiseLinear
from ..core.arrays import Array
from ..core.errors import ParameterError
from ..plant.columns import units_of
from ..plant.plant import Plant
from ..plant.state import check_state, state_vector
from ..recording import Recording
from .arguments import check_duration, default_initial_state, default_integrator, merge_output_times
from .integrators import INTERRUPTED, LESS_THAN_NONE, NO_COMMAND, NOT_FINITE, Integrator, RawSolution
from .result import raise_if_incomplete, to_recording
from .sampled_loop import SampledLoop, columns_of, prepare_loop


@dataclasses.dataclass(frozen=True, eq=False)
class ClosedLoopResult:
    """A run with a controller, and where it can be taken up: `simulate_closed_loop(..., start=run.state, start_time=run.time,
    memory=run.memory)`. Of a run that ended early this is the sampling instant before its end."""

    recording: Recording
    time: float
    state: Mapping[str, float]
    memory: ControlLoopState


def simulate_closed_loop(
    plant: System,
    loop: ControlLoop,
    *,
    duration: float,
    start: Mapping[str, float] | None = None,
    start_time: float = 0.0,
    memory: ControlLoopState | None = None,
    method: Integrator | None = None,
    output: float | npt.ArrayLike | None = None,
    complete: bool = True,
) -> ClosedLoopResult:
    """As `simulate`, with a Loop: its recording, and the state and memory with which the run goes on.

    The recording also holds `setpoint.`, `measured.` and `command.` columns: the set points in time, and what the
    controller measured and commanded at the last sample. Every sampling instant is a row. What it measures at an
    instant are the values that come before its command: an output that jumps with an input has not jumped yet.

    Cut at a sampling instant and taken up again, a run is the run in one, to the last bit; cut between two, to the
    tolerance of its method. Raises ParameterError for a column or input that the plant lacks, a period that is longer
    than the run, and a memory that belongs to another instant.
    """
    duration, start_time = check_duration(duration, start_time)
    from ..compile.program import compile_system

    if start is None:
        start = default_initial_state(plant)
    method, ready = default_integrator(method), compile_system(plant)
    loop.check_columns(columns_of(ready), plant.inputs)
    state = state_vector(plant, start)
    if isinstance(plant, Plant):
        check_state(plant, start)
    if memory is None:
        loop.check_period(duration)
        memory = loop.init(start_time)
    closed = prepare_loop(ready, loop, memory, start_time, duration, method, output)
    done = _integrate(closed, memory, state)
    segments, course, times = _concatenate(done, len(plant.inputs))
    recording, course = to_recording(ready, course, segments, times, start_time, method)
    recording = _with_controller(recording, closed, done, units_of(plant, ready.output_names))
    recording = raise_if_incomplete(plant, recording, course, start_time + duration, complete)
    names = [s.name for s in plant.states]
    return ClosedLoopResult(recording, done.time, dict(zip(names, done.state.tolist(), strict=True)), done.memory)


class _Interval(NamedTuple):
    """What was carried between two samples: inputs, states at rows, and what the controller had seen and told."""

    segments: PiecewiseLinear
    course: RawSolution
    times: Array
    seen: tuple[float, ...]
    told: tuple[float, ...]


class _Outcome(NamedTuple):
    """What was carried, how it ended, and from where it can go on."""

    pieces: list[_Interval]
    status: int
    time: float
    state: Array
    memory: ControlLoopState


def _integrate(closed: SampledLoop, memory: ControlLoopState, state: Array) -> _Outcome:
    """The loop from edge to edge, until the end or until a piece fails."""
    pieces: list[_Interval] = []
    edges, setpoints = closed.edges.tolist(), closed.setpoint.inputs_at(closed.edges[:-1], closed.start).tolist()
    had = np.array(memory.applied_inputs) if memory.applied_inputs else closed.before()
    time, last, status = closed.start, memory, 0
    for k in range(len(edges) - 1):
        try:
            if k or closed.sampled:
                memory, status = _sampled(closed, last, state, had, setpoints[k])
                if status:
                    break
            piece, memory = _piece(closed, memory, state, edges[k], k)
        except KeyboardInterrupt:
            status = INTERRUPTED
            break
        pieces.append(piece)
        course, segments = piece.course, piece.segments
        status = LESS_THAN_NONE if course.status == 0 and (course.state < closed.lower_bounds).any() else course.status
        if status:
            break
        begin = segments.ends[-2] if segments.ends.size > 1 else edges[k]
        had = segments.values[-1] + segments.slopes[-1] * (edges[k + 1] - begin)
        time, state, last = edges[k + 1], course.state, memory
    return _Outcome(pieces, status, time, state, last._replace(time=time, applied_inputs=tuple(had.tolist())))


def _sampled(
    closed: SampledLoop, memory: ControlLoopState, state: Array, had: Array, setpoints: Sequence[float]
) -> tuple[ControlLoopState, int]:
    """The memory after a sample, with what is commanded from now on; and whether it can be."""
    controller = closed.loop.controller
    columns = closed.measure(state, had)
    if not all(map(math.isfinite, columns.values())):
        return memory, NOT_FINITE
    measurement = Measurement(columns, dict(zip(controller.setpoints, setpoints, strict=True)), closed.ranges)
    commands, inner = controller.step(memory.controller, measurement, closed.loop.period)
    try:
        told = tuple([min(max(0.0 + commands[name], low), high) for name, (low, high) in closed.ranges.items()])
    except (KeyError, TypeError, ValueError):
        raise ParameterError(
            f"{type(controller).__name__} commands {commands!r}; it must give a number for each of "
            f"{', '.join(controller.inputs)}."
        ) from None
    if not all(map(math.isfinite, told)):
        return memory, NO_COMMAND
    seen = tuple(columns.values())
    return memory._replace(controller=inner, sample_count=memory.sample_count + 1, measured=seen, commanded=told), 0


def _piece(
    closed: SampledLoop, memory: ControlLoopState, state: Array, begin: float, k: int
) -> tuple[_Interval, ControlLoopState]:
    """The plant from one edge, at `begin`, to the next under what is commanded."""
    segments = closed.told(k, memory.commanded)
    times = closed.times[closed.row_offsets[k] : closed.row_offsets[k + 1]]
    if closed.loop.drivers:
        segments, drivers = closed.driven.apply_drivers(memory.drivers, segments, closed.inputs, begin)
        memory = memory._replace(drivers=drivers)
        if segments.ends.size > 1:
            times = merge_output_times(times, segments.ends, closed.loop.period)
    course = closed.stepper.run(segments, begin, state, times)
    return _Interval(segments, course, times, memory.measured, memory.commanded), memory


def _concatenate(done: _Outcome, inputs: int) -> tuple[PiecewiseLinear, RawSolution, Array]:
    """All pieces as one course of the inputs, one of the states, and its rows."""
    segments, courses = [piece.segments for piece in done.pieces], [piece.course for piece in done.pieces]
    of_inputs = PiecewiseLinear(
        np.concatenate([np.empty(0), *(s.ends for s in segments)]),
        np.concatenate([np.empty((0, inputs)), *(s.values for s in segments)]),
        np.concatenate([np.empty((0, inputs)), *(s.slopes for s in segments)]),
    )
    times = np.concatenate([np.empty(0), *(p.times[: p.course.reached] for p in done.pieces)])
    rows = np.concatenate([np.empty((0, done.state.size)), *(c.rows[: c.reached] for c in courses)])
    time, state = (courses[-1].time, courses[-1].state) if courses else (done.time, done.state)
    steps, rejected = (sum(getattr(c, name) for c in courses) for name in ("steps", "rejected"))
    return of_inputs, RawSolution(rows, times.size, time, state, done.status, steps, rejected), times


def _with_controller(recording: Recording, closed: SampledLoop, done: _Outcome, units: Mapping[str, str]) -> Recording:
    """The recording with set points, measurements and commands, and a note of who commanded."""
    controller, time = closed.loop.controller, recording["time"]
    at = np.clip(np.searchsorted(closed.edges, time, side="right") - 1, 0, max(len(done.pieces) - 1, 0))
    setpoints = closed.setpoint.inputs_at(time, closed.start)
    columns = {f"{SETPOINT}{name}": setpoints[:, i] for i, name in enumerate(controller.setpoints)}
    seen, told = ([getattr(piece, kind) for piece in done.pieces] for kind in ("seen", "told"))
    for start, names, values in ((MEASURED, controller.measured_columns, seen), (COMMAND, controller.inputs, told)):
        of_pieces = np.array(values, dtype=float).reshape(-1, len(names))
        columns |= {f"{start}{name}": of_pieces[at, i] for i, name in enumerate(names)}
    note = f"controlled: {closed.loop.describe(units)}"
    return dataclasses.replace(recording.with_columns(**columns), notes=(note, *recording.notes))
