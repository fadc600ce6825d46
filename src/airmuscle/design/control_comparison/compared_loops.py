"""Runs of several control loops on a nominal plant and on truths, and their margins."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...control.laws import LinearLoop, Margins, linearise_loop
from ...core import (
    AirmuscleError,
    Array,
    ParameterError,
    PhysicsError,
    ShortRepr,
    SimulationError,
    check_field_types,
    counted,
)
from ...engine.compile import compile_system
from ...engine.distribution import DistributedCalls
from ...engine.loop import ColumnSensor, ControlLaw, ControlLoop, WithSensors
from ...engine.processes import Workers, process_pool
from ...engine.run import Integrator, Problem, Solution, solve
from ...physics import Plant
from ...physics.equilibrium import nearest_equilibrium
from ...recording import Recording
from ..tuning.case import check_names
from .loop_metrics import LoopMetrics, judge_run

NOMINAL = "nominal"
"""Name of the plant that the controllers are designed for."""
SAME_SETPOINT = 1e-9
"""Relative difference within which two set points are one (chosen)."""
OPEN = 0.01
"""Opening of a valve at which a loop is linearised where the closed one is a kink (chosen)."""
FILL = "fill"
DISCHARGE = "discharge"
"""Ends of the names of the inputs of valves."""
LOOKED_AT = 1001
"""Instants of a run at which the set points of two loops are compared (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ComparedLoop(ShortRepr):
    """A control loop with its name in tables."""

    name: str
    loop: ControlLoop

    def __post_init__(self) -> None:
        check_field_types(self)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ComparedPlant(ShortRepr):
    """A plant on which all loops run.

    name           in tables
    plant          of the structure of the nominal one
    initial_state  a value for each state [SI]
    delay          dead time of all measurements beside that which the loops have [samples]
    values         of the parameters that were drawn, by their paths
    """

    name: str
    plant: Plant
    initial_state: Mapping[str, float]
    delay: int = 0
    values: Mapping[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        check_field_types(self)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RunSettings(ShortRepr):
    """What all runs have in common: duration and start [s], time from the start from which on they
    are judged [s], integrator, and the time between rows [s].
    """

    duration: float
    start_time: float = 0.0
    begin: float = 0.0
    integrator: Integrator | None = None
    row_time: float = 1e-2

    def __post_init__(self) -> None:
        check_field_types(self)
        if not 0.0 <= self.begin < self.duration:
            raise ParameterError(
                f"begin is {self.begin:g} s; allowed range: 0 to {self.duration:g} s, the duration"
                " of the run."
            )


class ColumnMargins(NamedTuple):
    """Margins of a loop opened at a measured column, and where; None with the reason."""

    column: str
    margins: Margins | None
    reason: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LoopRun(ShortRepr):
    """A run of a loop on a plant, or the reason why it ended early.

    recording and margins are those of the nominal plant alone.
    """

    metrics: LoopMetrics | None
    reason: str = ""
    recording: Recording | None = None
    margins: tuple[ColumnMargins, ...] = ()


class RunName(NamedTuple):
    """Loop and plant of a run."""

    loop: str
    plant: str


def plant_columns(plant: Plant) -> tuple[str, ...]:
    """Names of the states and outputs of a plant."""
    description = compile_system(plant).description
    return (*description.state_names, *description.output_names)


def controlled_columns(loops: Sequence[ComparedLoop], plant: Plant) -> tuple[str, ...]:
    """The columns of a plant with a set point in every loop. Raises ParameterError for none."""
    known = plant_columns(plant)
    of_loops = [
        [name for name in compared.loop.controller.setpoints if name in known] for compared in loops
    ]
    common = tuple(name for name in of_loops[0] if all(name in names for names in of_loops[1:]))
    if not common:
        controlled = "; ".join(
            f"{compared.name}: {', '.join(names) or 'none'}"
            for compared, names in zip(loops, of_loops, strict=True)
        )
        raise ParameterError(
            "compare: no column of the plant has a set point in every loop, so that their errors"
            f" cannot be compared. Set points that are columns: {controlled}."
        )
    return common


def run_loops(
    loops: Sequence[ComparedLoop],
    plants: Sequence[ComparedPlant],
    settings: RunSettings,
    *,
    workers: Workers = 1,
    progress: Callable[[int, int], object] = lambda done, total: None,
) -> dict[RunName, LoopRun]:
    """All runs, by loop and plant; a run is a task for the workers.

    Raises ParameterError for names that occur twice, loops without a common column, and set points
    that differ.
    """
    check_names("compare", "loop", [compared.name for compared in loops])
    check_names("compare", "plant", [compared.name for compared in plants])
    nominal = plants[0]
    columns = controlled_columns(loops, nominal.plant)
    for compared in loops:
        check_delay(compared, max(plant.delay for plant in plants))
    check_same_task(loops, columns, settings)
    tasks = [(compared, plant, plant is nominal) for plant in plants for compared in loops]
    with process_pool(workers) as executor:
        calls = DistributedCalls(executor, _run, (columns, settings))
        results = calls.results(tasks, lambda done: progress(done, len(tasks)))
    runs = {
        RunName(compared.name, plant.name): run
        for (compared, plant, _), run in zip(tasks, results, strict=True)
    }
    return runs


def check_delay(compared: ComparedLoop, delay: int) -> None:
    """Raise ParameterError for a controller whose measurements cannot be delayed."""
    if delay and not isinstance(compared.loop.controller, ControlLaw):
        raise ParameterError(
            f"{compared.name}: {type(compared.loop.controller).__name__} is no ControlLaw, whose"
            " measurements could be delayed. Compare without a drawn dead time."
        )


def check_same_task(
    loops: Sequence[ComparedLoop], columns: Sequence[str], settings: RunSettings
) -> None:
    """Raise ParameterError where the set points of two loops differ: their errors are not those of
    one task.
    """
    start, duration = settings.start_time, settings.duration
    times = start + np.linspace(0.0, duration, LOOKED_AT)
    first = loops[0]

    def signals(compared: ComparedLoop) -> Array:
        setpoints = compared.loop.controller.setpoints
        segments = compared.loop.setpoint.segments(setpoints, start, duration)
        places = [setpoints.index(column) for column in columns]
        return segments.inputs_at(times, start)[:, places]

    reference = signals(first)
    sizes = np.abs(reference).max(axis=0)
    for compared in loops[1:]:
        values = signals(compared)
        differs = np.abs(values - reference) > SAME_SETPOINT * sizes
        if differs.any():
            row, place = (int(n) for n in np.argwhere(differs)[0])
            raise ParameterError(
                f"compare: the set points of '{columns[place]}' differ: at {times[row]:.4g} s that"
                f" of '{first.name}' is {reference[row, place]:.4g} and that of '{compared.name}'"
                f" {values[row, place]:.4g}. Give both scenarios the same"
                " [input.controller.setpoint]."
            )


def _run(
    common: tuple[tuple[str, ...], RunSettings], task: tuple[ComparedLoop, ComparedPlant, bool]
) -> LoopRun:
    """A run with its metrics; of the nominal plant also with recording and margins."""
    columns, settings = common
    compared, plant, is_nominal = task
    loop = _delayed(compared.loop, plant.delay)
    problem = Problem(
        plant.plant,
        loop,
        settings.duration,
        plant.initial_state,
        settings.start_time,
        settings.row_time,
        settings.integrator,
    )
    try:
        solution = solve(problem).raise_if_incomplete()
    except (PhysicsError, SimulationError) as error:
        return LoopRun(None, str(error))
    record = solution.recording
    metrics = judge_run(plant.plant, loop, record, columns, settings.begin)
    if not all(math.isfinite(value) for value in metrics.rmse.values()):
        return LoopRun(None, "the error is not finite")
    if not is_nominal:
        return LoopRun(metrics)
    return LoopRun(metrics, "", record, margins_at_end(plant.plant, loop, solution))


def _delayed(loop: ControlLoop, delay: int) -> ControlLoop:
    """The loop with a dead time of all measurements [samples]."""
    law: Any = loop.controller
    if not delay:
        return loop
    sensors = tuple(ColumnSensor(name, delay=delay) for name in law.measured_columns)
    return dataclasses.replace(loop, controller=WithSensors(law, sensors))


def margins_at_end(
    plant: Plant, loop: ControlLoop, solution: Solution
) -> tuple[ColumnMargins, ...]:
    """The margins of a loop at the end of its run, opened at each measured column.

    Where the run does not end at rest, or at a kink of the law such as a closed valve, they are
    those of the equilibrium at its last pressures with the valves open by a little.
    """
    names = loop.controller.measured_columns
    try:
        linear = linearise_loop(
            plant, loop, solution.final_state, control_state=solution.control_state
        )
        remark = "at the end of the run"
    except AirmuscleError as error:
        reason = str(error)
        try:
            linear = _linear_at_equilibrium(plant, loop, solution.recording)
        except AirmuscleError:
            return (ColumnMargins(", ".join(names), None, reason),)
        remark = f"equilibrium at the last pressures, {100 * OPEN:g} % open"
    found = []
    for name in names:
        try:
            found.append(ColumnMargins(name, linear.margins(name), remark))
        except AirmuscleError as error:
            found.append(ColumnMargins(name, None, str(error)))
    return tuple(found)


def _linear_at_equilibrium(plant: Plant, loop: ControlLoop, record: Recording) -> LinearLoop:
    """The loop at the equilibrium at the last pressures of a run, with its valves for filling open
    by a little.
    """
    pressures = tuple(float(record[f"{prefix}pressure"][-1]) for prefix in plant.prefixes)
    state = nearest_equilibrium(plant, pressure=pressures)
    inputs = {
        variable.name: OPEN if variable.name.endswith(FILL) else float(record[variable.name][-1])
        for variable in plant.input_variables
        if not variable.name.endswith(DISCHARGE)
    }
    return linearise_loop(plant, loop, state, inputs)


def counted_plants(plants: Sequence[ComparedPlant]) -> str:
    """The number of plants as a text, with the nominal one named."""
    others = len(plants) - 1
    return f"the nominal plant and {counted(others, 'truth')}" if others else "the nominal plant"
