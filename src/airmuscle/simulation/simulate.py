"""Carrying a plant through time. A simulation returns a Recording, the type that a bench file becomes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ..compile import System
from ..control.inputs import Command, Schedule, Segments, refuse_no_command
from ..control.loop import Loop
from ..core.errors import ParameterError, SimulationError
from ..core.model import number_of
from ..plant.plant import Plant
from ..plant.state import less_than_none, refuse_impossible, refuse_no_system, state_vector
from ..recording import Recording
from .arguments import chosen_method, output_times, refuse_beyond_range, rest_of, run_length
from .closed_loop import run_loop
from .integrators import LESS_THAN_NONE, Method
from .result import ended, problem, recorded


def simulate(
    plant: System,
    command: Command | Loop,
    *,
    duration: float,
    start: Mapping[str, float] | None = None,
    start_time: float = 0.0,
    method: Method | None = None,
    output: float | npt.ArrayLike | None = None,
    complete: bool = True,
) -> Recording:
    """Run a plant under a command for `duration` [s], and return its states, outputs and inputs as a Recording.

    plant     any System: a Plant, or one's own
    command   in time, a Schedule say; or a Loop, whose controller looks at the plant (see run_loop, which also says how
              such a run is taken up again)
    start     state by name; by default a Plant's equilibrium at ambient pressure
    method    Rodas4(rtol=1e-6) unless given
    output    spacing [s] or instants [s] of the rows; by default 1/1000 of the run, 10 ms at the coarsest. The
              command's instants are always among the rows, with the inputs that begin there
    complete  whether a run that ends early raises SimulationError (its `.recording` holds what was computed);
              otherwise that part is returned, with the reason in its notes

    The result does not depend on `output`. Raises ParameterError for an input or state that the plant lacks.
    """
    refuse_no_system("simulate", plant)
    if isinstance(command, Loop):
        return run_loop(
            plant, command, duration=duration, start=start, start_time=start_time, method=method, output=output,
            complete=complete,
        ).recording  # fmt: skip
    refuse_no_command(command)
    duration, start_time = run_length(duration, start_time)
    from ..compile.program import prepared  # CasADi, which describing a plant does not need

    if start is None:
        start = rest_of(plant)
    method = chosen_method(method)
    ready = prepared(plant)
    segments = command.segments(plant.inputs, start_time, duration)
    segments.refuse_misshapen(len(plant.inputs), start_time)
    refuse_beyond_range(plant, segments, start_time)
    times = output_times(output, start_time, duration, segments.ends)
    state = state_vector(plant, start)
    if isinstance(plant, Plant):
        refuse_impossible(plant, start)
    course = method.run(ready, segments, start_time, state, times)
    recording, course = recorded(ready, course, segments, times, start_time, method)
    return ended(plant, recording, course, start_time + duration, complete)


def advance(
    plant: System,
    state: Mapping[str, float],
    inputs: Mapping[str, float] | Segments,
    dt: float,
    method: Method | None = None,
    *,
    start_time: float = 0.0,
) -> dict[str, float]:
    """The state after `dt` [s] with the inputs held: the seam that controllers and exports call.

    Inputs that move meanwhile, as a driver makes them, are given as Segments from `start_time` on:
    `segments, memory = Driven(hold, drivers).step(memory, plant.inputs, start_time, dt)`.
    Raises SimulationError where the step fails, ParameterError for an unknown name or an input beyond its range.
    """
    from ..compile.program import prepared

    refuse_no_system("advance", plant)
    dt, start_time = number_of("advance: dt", dt), number_of("advance: start_time", start_time)
    if not 0 < dt < np.inf:
        raise ParameterError(f"advance: dt is {dt!r} s; it must be positive and finite.")
    if isinstance(inputs, Segments):
        segments = inputs
        segments.refuse_misshapen(len(plant.inputs), start_time)
        if abs(float(segments.ends[-1]) - start_time - dt) > 1e-9 * dt:
            raise ParameterError(
                f"advance: the segments end at {segments.ends[-1]:g} s; start_time + dt is {start_time + dt:g} s."
            )
    else:
        if not isinstance(inputs, Mapping):
            raise ParameterError(f"advance: inputs are {inputs!r}; give a value for each name, or Segments.")
        hold = Schedule({name: ((start_time, value),) for name, value in inputs.items()})
        segments = hold.segments(plant.inputs, start_time, dt)
    refuse_beyond_range(plant, segments, start_time)
    course = chosen_method(method).run(prepared(plant), segments, start_time, state_vector(plant, state), np.empty(0))
    if course.status == 0 and less_than_none(plant, course.state).any():
        course = course._replace(status=LESS_THAN_NONE)
    if course.status != 0:
        raise SimulationError(problem(plant, course, start_time + dt))
    return {s.name: float(v) for s, v in zip(plant.states, course.state, strict=True)}
