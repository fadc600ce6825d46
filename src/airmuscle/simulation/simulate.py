"""Carrying a plant through time. A simulation returns a Recording, the type that a bench file becomes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ..compile import System
from ..control.control_loop import ControlLoop
from ..control.inputs import InputSignal, PiecewiseLinear, Schedule, check_input_signal
from ..core.declaration import as_float
from ..core.errors import ParameterError, SimulationError
from ..plant.plant import Plant
from ..plant.state import check_state, check_system, has_negative_mass, state_vector
from ..recording import Recording
from .arguments import check_duration, check_input_range, default_initial_state, default_integrator, output_times
from .closed_loop import simulate_closed_loop
from .integrators import LESS_THAN_NONE, Integrator
from .result import failure_message, raise_if_incomplete, to_recording


def simulate(
    plant: System,
    command: InputSignal | ControlLoop,
    *,
    duration: float,
    start: Mapping[str, float] | None = None,
    start_time: float = 0.0,
    method: Integrator | None = None,
    output: float | npt.ArrayLike | None = None,
    complete: bool = True,
) -> Recording:
    """Run a plant under a command for `duration` [s], and return its states, outputs and inputs as a Recording.

    plant     any System: a Plant, or one's own
    command   in time, a Schedule say; or a Loop, whose controller looks at the plant (see simulate_closed_loop, which also says how
              such a run is taken up again)
    start     state by name; by default a Plant's equilibrium at ambient pressure
    method    Rodas4(rtol=1e-6) unless given
    output    spacing [s] or instants [s] of the rows; by default 1/1000 of the run, 10 ms at the coarsest. The
              command's instants are always among the rows, with the inputs that begin there
    complete  whether a run that ends early raises SimulationError (its `.recording` holds what was computed);
              otherwise that part is returned, with the reason in its notes

    The result does not depend on `output`. Raises ParameterError for an input or state that the plant lacks.
    """
    check_system("simulate", plant)
    if isinstance(command, ControlLoop):
        return simulate_closed_loop(
            plant, command, duration=duration, start=start, start_time=start_time, method=method, output=output,
            complete=complete,
        ).recording  # fmt: skip
    check_input_signal(command)
    duration, start_time = check_duration(duration, start_time)
    from ..compile.program import compile_system  # CasADi, which describing a plant does not need

    if start is None:
        start = default_initial_state(plant)
    method = default_integrator(method)
    ready = compile_system(plant)
    segments = command.segments(plant.inputs, start_time, duration)
    segments.check_shape(len(plant.inputs), start_time)
    check_input_range(plant, segments, start_time)
    times = output_times(output, start_time, duration, segments.ends)
    state = state_vector(plant, start)
    if isinstance(plant, Plant):
        check_state(plant, start)
    course = method.run(ready, segments, start_time, state, times)
    recording, course = to_recording(ready, course, segments, times, start_time, method)
    return raise_if_incomplete(plant, recording, course, start_time + duration, complete)


def advance(
    plant: System,
    state: Mapping[str, float],
    inputs: Mapping[str, float] | PiecewiseLinear,
    dt: float,
    method: Integrator | None = None,
    *,
    start_time: float = 0.0,
) -> dict[str, float]:
    """The state after `dt` [s] with the inputs held: the seam that controllers and exports call.

    Inputs that move meanwhile, as a driver makes them, are given as Segments from `start_time` on:
    `segments, memory = WithDrivers(hold, drivers).step(memory, plant.inputs, start_time, dt)`.
    Raises SimulationError where the step fails, ParameterError for an unknown name or an input beyond its range.
    """
    from ..compile.program import compile_system

    check_system("advance", plant)
    dt, start_time = as_float("advance: dt", dt), as_float("advance: start_time", start_time)
    if not 0 < dt < np.inf:
        raise ParameterError(f"advance: dt is {dt!r} s; it must be positive and finite.")
    if isinstance(inputs, PiecewiseLinear):
        segments = inputs
        segments.check_shape(len(plant.inputs), start_time)
        if abs(float(segments.ends[-1]) - start_time - dt) > 1e-9 * dt:
            raise ParameterError(
                f"advance: the segments end at {segments.ends[-1]:g} s; start_time + dt is {start_time + dt:g} s."
            )
    else:
        if not isinstance(inputs, Mapping):
            raise ParameterError(f"advance: inputs are {inputs!r}; give a value for each name, or Segments.")
        hold = Schedule({name: ((start_time, value),) for name, value in inputs.items()})
        segments = hold.segments(plant.inputs, start_time, dt)
    check_input_range(plant, segments, start_time)
    course = default_integrator(method).run(
        compile_system(plant), segments, start_time, state_vector(plant, state), np.empty(0)
    )
    if course.status == 0 and has_negative_mass(plant, course.state).any():
        course = course._replace(status=LESS_THAN_NONE)
    if course.status != 0:
        raise SimulationError(failure_message(plant, course, start_time + dt))
    return {s.name: float(v) for s, v in zip(plant.states, course.state, strict=True)}
