"""Carrying a plant through time. A simulation returns a Recording, the type that a bench file becomes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .command import Command, Schedule, Segments, refuse_no_command
from .declare import number_of
from .doubt import at_end_of_reach, beyond_laws, stopped_where_impossible
from .equilibrium import equilibrium
from .errors import ParameterError, SimulationError
from .method import INTERRUPTED, LESS_THAN_NONE, REASONS, Course, Method, Rodas4
from .muscle import INNER, SeriesSpring
from .plant import Plant
from .program import System
from .recording import Recording
from .start import less_than_none, refuse_impossible, refuse_no_system, state_vector

if TYPE_CHECKING:
    from .program.prepared import Prepared

Array = npt.NDArray[np.float64]
COARSEST = 0.01
"""Output is at least this fine [s] unless asked otherwise."""
MOST_ROWS = 10_000_000
"""Rows of a recording that fit a usual memory."""


def simulate(
    plant: System,
    command: Command,
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
    start     state by name; by default a Plant's equilibrium at ambient pressure
    method    Rodas4(rtol=1e-6) unless given
    output    spacing [s] or instants [s] of the rows; by default 1/1000 of the run, 10 ms at the coarsest. The
              command's instants are always among the rows, with the inputs that begin there
    complete  whether a run that ends early raises SimulationError (its `.recording` holds what was computed);
              otherwise that part is returned, with the reason in its notes

    The result does not depend on `output`. Raises ParameterError for an input or state that the plant lacks.
    """
    refuse_no_system("simulate", plant)
    refuse_no_command(command)
    start_time, duration = _span(start_time, duration)
    from .program.prepared import prepared  # CasADi, which describing a plant does not need

    if start is None:
        start = _rest(plant)
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
    results, inputs = _results(ready, course, segments, times, start_time)
    course = stopped_where_impossible(ready, course, results, times)
    recording = _recorded(ready, course, results, inputs, times, method)
    if course.status != 0:
        problem = _problem(plant, course, start_time + duration)
        recording = dataclasses.replace(recording, notes=(*recording.notes, problem))
        if complete:
            raise SimulationError(problem, recording, interrupted=course.status == INTERRUPTED)
    return recording


def _span(start_time: float, duration: float) -> tuple[float, float]:
    """When a run begins and how long it lasts [s]. Raises ParameterError where no time would pass."""
    duration, start_time = number_of("simulate: duration", duration), number_of("simulate: start_time", start_time)
    if not (np.isfinite(duration) and duration > 0):
        raise ParameterError(f"simulate: duration is {duration!r} s; it must be positive and finite.")
    if not start_time + duration > start_time:
        raise ParameterError(f"simulate: start_time is {start_time!r} s; {duration!r} s after it no time has passed.")
    return start_time, duration


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
    from .program.prepared import prepared

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
        raise SimulationError(_problem(plant, course, start_time + dt))
    return {s.name: float(v) for s, v in zip(plant.states, course.state, strict=True)}


def output_times(output: float | npt.ArrayLike | None, start: float, duration: float, instants: Array) -> Array:
    """The instants [s] at which a run is recorded, in rising order, the command's instants among them."""
    end = start + duration
    if output is None:
        output = min(duration / 1000, COARSEST)
    if not np.ndim(output):
        output = number_of("simulate: output", output)
        if not 0 < output < np.inf:
            raise ParameterError(f"simulate: an output spacing of {output!r} s is not positive and finite.")
        if duration / output > MOST_ROWS:
            raise ParameterError(
                f"simulate: an output spacing of {output!r} s makes {duration / output:.3g} rows of a run of "
                f"{duration:g} s; {MOST_ROWS} are allowed. The result does not depend on it: choose a wider one."
            )
        grid = start + output * np.arange(int(np.floor(duration / output * (1 + 1e-12))) + 1)
    else:
        grid = _instants(output)
        if grid.size and not (grid[0] >= start and grid[-1] <= end):
            raise ParameterError(f"simulate: output instants must lie within {start:g} to {end:g} s.")
    behind = np.searchsorted(instants, grid)  # two neighbours of each: a table of all pairs would not fit the memory
    before, after = instants[np.maximum(behind - 1, 0)], instants[np.minimum(behind, instants.size - 1)]
    apart = np.minimum(np.abs(grid - before), np.abs(grid - after)) > 1e-9 * duration
    return np.unique(np.concatenate([grid[apart], instants]))


def _instants(given: Any) -> Array:
    """Instants [s] in rising order, from a list of them."""
    try:
        found = np.array(given, dtype=float)
    except (TypeError, ValueError):
        found = np.empty((0, 0))
    if found.ndim != 1:
        raise ParameterError(f"simulate: output is {given!r}; give a spacing [s] or a list of instants [s].")
    return np.sort(found)


def chosen_method(method: Method | None) -> Method:
    """The method that is given, or the default. Raises ParameterError for what is none, as a name is."""
    if method is None:
        return Rodas4()
    if not isinstance(method, Method):
        raise ParameterError(f"the method is {method!r}; give Rodas4(), RungeKutta4(step) or DormandPrince8(step).")
    return method


def refuse_beyond_range(plant: System, segments: Segments, start: float) -> None:
    """Raise ParameterError where a Plant is commanded beyond what its inputs allow; other systems' are theirs."""
    if not isinstance(plant, Plant):
        return
    lengths = np.diff(segments.ends, prepend=start)[:, None]
    least, greatest = (np.array([getattr(i, end) for i in plant.commands]) for end in ("least", "greatest"))
    slack = 1e-9 * (greatest - least)
    for values in (segments.values, segments.values + segments.slopes * lengths):
        beyond = (values < least - slack) | (values > greatest + slack)
        if beyond.any():
            row, column = np.argwhere(beyond)[0]
            given = plant.commands[column]
            unit = "" if given.unit == "1" else f" {given.unit}"
            raise ParameterError(
                f"the input '{given.name}' is {values[row, column]:g}{unit} before {segments.ends[row]:g} s; allowed "
                f"are {given.least:g} to {given.greatest:g}{unit} ({given.meaning})."
            )


def _rest(plant: System) -> Mapping[str, float]:
    if isinstance(plant, Plant):
        return equilibrium(plant, pressure=0.0)
    raise ParameterError(f"simulate: give the start of {type(plant).__name__}, a value for each state.")


def _results(ready: Prepared, course: Course, segments: Segments, times: Array, start: float) -> tuple[Array, Array]:
    """Outputs (N, K) and inputs (N, m) at the rows that were reached."""
    from .engine.evaluate import evaluate
    from .engine.once import announce_compilation

    states = np.ascontiguousarray(course.rows[: course.reached])
    inputs = np.ascontiguousarray(segments.inputs_at(times[: course.reached], start))
    results = np.empty((course.reached, ready.sizes.outputs))
    announce_compilation(evaluate)
    evaluate(ready.address["outputs"], ready.held, states, inputs, results)
    return results, inputs


def _recorded(
    ready: Prepared, course: Course, results: Array, inputs: Array, times: Array, method: Method
) -> Recording:
    plant, reached = ready.system, course.reached
    states, results, inputs = course.rows[:reached], results[:reached], inputs[:reached]
    columns: dict[str, Any] = {"time": times[:reached]}
    columns |= {s.name: states[:, i] for i, s in enumerate(plant.states)}
    columns |= {name: results[:, i] for i, name in enumerate(ready.output_names)}
    columns |= {name: inputs[:, i] for i, name in enumerate(plant.inputs)}
    notes: list[str] = [f"simulated by {method}: {course.steps} steps, {course.rejected} rejected"]
    constants: dict[str, float | str] = {}
    if isinstance(plant, Plant):
        constants = {"ambient": plant.ambient.pressure}
        if len(plant.muscles) == 1:
            constants["resting_length"] = plant.muscles[0].geometry.resting_length
        notes += [f"gas: {plant.gas}", friction_in_words(plant), *outside_box(plant, columns)]
        notes += beyond_laws(plant, columns) if reached else []
    return Recording(columns, "simulation", constants, tuple(notes))


def friction_in_words(plant: Plant) -> str:
    """What friction a plant's muscles have; the default is none, which a reader should know."""
    if not any(m.friction.states for m in plant.muscles):
        return "friction: off"
    words = [f"{m.name} {m.friction if m.friction.states else 'none'}" for m in plant.muscles]
    return f"friction: {', '.join(words) if len(words) > 1 else plant.muscles[0].friction}"


def outside_box(plant: Plant, columns: Mapping[str, Any]) -> list[str]:
    """When and how far a run left the box in which a muscle's characteristic has data, or the reach of a geometry."""
    found = []
    for prefix, muscle in zip(plant.prefixes, plant.muscles, strict=True):
        of_muscle = []
        box = muscle.box or getattr(muscle.contractile, "box", None)
        if box is not None:
            left, doubt = f"{muscle.name} was outside the box of its characteristic", "nothing was measured there"
            of_muscle += [("pressure", box.pressure, left, doubt), ("contraction", box.contraction, left, doubt)]
        own = INNER if isinstance(muscle.series, SeriesSpring) else "contraction"
        if f"{prefix}{own}" in columns:  # of a batch that may not be kept
            left, doubt = f"{muscle.name} was beyond the reach of its geometry", "no muscle can do this"
            of_muscle.append((own, muscle.geometry.contraction_reach, left, doubt))
        for name, bounds, left, doubt in of_muscle:
            found += _beyond(columns["time"], columns[f"{prefix}{name}"], name, bounds, left, doubt)
    return found


def _beyond(time: Array, values: Array, name: str, bounds: tuple[float, float], left: str, doubt: str) -> list[str]:
    """A note where a column of pressure or contraction leaves its bounds."""
    (low, high), (scale, unit) = bounds, (1e3, "kPa") if name == "pressure" else (0.01, "%")
    if not ((beyond := np.maximum(low - values, values - high)) > 1e-9 * (high - low)).any():
        return []
    worst, share = int(np.argmax(beyond)), float(np.mean(beyond > 0))
    return [
        f"{left} in {name} ({low / scale:.4g} to {high / scale:.4g} {unit}) in {share:.0%} of the rows, by at most "
        f"{beyond[worst] / scale:.4g} {unit} at {time[worst]:.4g} s; {doubt}"
    ]


def _problem(plant: System, course: Course, end: float) -> str:
    state = ", ".join(f"{s.name} {v:.6g} {s.unit}" for s, v in zip(plant.states, course.state, strict=True))
    remedy = {
        4: "Raise the tolerance, lengthen a fixed step, or look for a valve that chatters.",
        5: "Nothing is lost; what was computed is in the recording.",
    }.get(course.status, "Look at the last state: a parameter may be far from physical, or a fixed step too long.")
    if isinstance(plant, Plant) and course.status != INTERRUPTED:
        remedy = at_end_of_reach(plant, course.state) or remedy
    return (
        f"the run ended at {course.time:.6g} of {end:.6g} s because {REASONS[course.status]}, after {course.steps} "
        f"steps, at {state}. {remedy}"
    )
