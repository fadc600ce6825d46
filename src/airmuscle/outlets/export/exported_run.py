"""Run of an exported program: its signals and times as numbers, its solver as text, and its control
loop.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ParameterError
from ...engine.compile.kernel_text.printer import KernelPrinter
from ...engine.compile.program import Description
from ...engine.loop import COMMAND, MEASURED, SETPOINT, PiecewiseLinear
from ...engine.run import ExplicitRungeKutta, Integrator, Problem, Rodas4, sampled_loop
from ...engine.run.sampled_loop import (
    CLOSE,
    KINDS,
    MAX_CAPACITY,
    DriverTable,
    SampledLoop,
    prepare_loop,
    snapped,
)
from .parameter_bounds import ParameterBounds
from .printed_controller import PrintedController
from .printed_predictive import check_control_law, print_any_controller, with_printable_controller
from .printed_system import ExportedSystem

SHAPES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(
        ("y", "yn", "x", "g", "f0", "ft", "k1", "k2", "k3", "k4", "k5", "k6", "d2", "d3"),
        ("STATES",),
    ),
    **dict.fromkeys(("absolute", "nominal", "between"), ("STATES",)),
    **dict.fromkeys(("u", "w", "base"), ("INPUTS",)),
    **dict.fromkeys(("nodes", "weights"), ("STAGES",)),
    "k": ("STAGES", "STATES"),
    "table": ("STAGES", "STAGES"),
    "jacobian": ("JACOBIAN",),
    "factors": ("FACTORS",),
}
"""Sizes of the arrays of the kernels of integrators."""
TABLEAU = ("table", "weights", "nodes")
"""Arguments that are the tableau of an explicit method: (s, s), (s,) and (s,)."""
STEP = {
    "y": "x",
    "base": "u",
    "w": "w",
    "moving": "moving",
    "t": "t",
    "start": "start",
    "end": "end",
    "h": "h",
    "relative": "rtol",
    "done": "done",
    "d2": "d2",
    "d3": "d3",
    "c": "c",
    "nominal": "nominal",
    **dict(zip(TABLEAU, TABLEAU, strict=True)),
}
"""Fields of the solver for the arguments of `single_step`."""
BETWEEN = {**STEP, "y": "x_before", "yn": "x", "t": "t_before", "h": "h_taken"}
"""Fields of the solver for the arguments of `state_between`."""
RESULTS = ("result", "reached", "taken", "following", "rejections")
"""Results of `single_step`."""


class SolverText(NamedTuple):
    """The step of an integrator in a language.

    places     printed functions, and their calls with their workspace, for a template
    constants  first step (0: to be found), distance within which a time belongs to a step, relative
               tolerance, tableau
    implicit   whether the step needs the Jacobian
    """

    places: dict[str, str]
    constants: dict[str, Any]
    implicit: bool


def solver_text(
    printer: KernelPrinter,
    integrator: Integrator,
    fields: Mapping[str, str],
    sizes: Mapping[str, str],
    work: str = "",
) -> SolverText:
    """The step of an integrator, with the texts of the fields of the solver that STEP and BETWEEN
    name, of the sizes in SHAPES, and of what stands before the names of arrays of the workspace."""
    kernels = printer.typed(integrator.printed_step, ("single_step", "state_between"))
    step = kernels["single_step"]
    tolerance = integrator.rtol if isinstance(integrator, Rodas4) else 0.0
    constants: dict[str, Any] = {"FIRST_STEP": 0.0, "CLOSE": 0.0, "RTOL": tolerance}
    if isinstance(integrator, ExplicitRungeKutta):
        rows, weights = integrator.tableau()
        table = np.zeros((len(weights), len(weights)))
        for i, row in enumerate(rows, 1):
            table[i, : len(row)] = row
        arrays = table, np.array(weights), np.array([0.0, *map(sum, rows)])
        constants |= {"FIRST_STEP": integrator.step, "CLOSE": 1e-9 * integrator.step}
        constants |= {
            key.upper(): array
            for key, array in zip(TABLEAU, arrays, strict=True)
            if key in step.arguments
        }
    places = {"steps": printer.printed(kernels)}
    for name, known, results in (("single_step", STEP, RESULTS), ("state_between", BETWEEN, ())):
        kernel = kernels[name]
        texts = {key: fields[field] for key, field in known.items()}
        workspace = [
            key for key in kernel.arguments if key in SHAPES and key not in {*texts, "between"}
        ]
        places[f"{name}_work"] = printer.workspace(
            {key: [sizes[size] for size in SHAPES[key]] for key in workspace}
        )
        places[name] = printer.bound_call(
            kernel, texts | {key: f"{work}{key}" for key in workspace}, results
        )
    return SolverText(places, constants, "jac" in step.called)


CONTROLLER = "controller."
"""Beginning of the paths of the parameters of a controller among those of its loop."""


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedLoop:
    """A control loop with its run.

    controller  the control law; the plant is in the system of the program
    others      segments of the inputs that are not commanded; an end near a sampling instant is at
                it
    """

    controller: PrintedController
    prepared: SampledLoop
    others: PiecewiseLinear
    drivers: DriverTable
    capacity: int

    @property
    def added_columns(self) -> tuple[tuple[str, ...], ...]:
        """The columns of set points, of measurements, and of commands."""
        law = self.controller.law
        kinds = zip(
            (SETPOINT, MEASURED, COMMAND),
            (law.setpoints, law.measured_columns, law.inputs),
            strict=True,
        )
        return tuple(tuple(f"{kind}{name}" for name in names) for kind, names in kinds)

    def measured_at(self, known: Description) -> list[tuple[int, int]]:
        """Of each measured column: 0 for a state and 1 for an output, and its number among
        these.
        """
        return places_of(
            self.controller.law.measured_columns, (known.state_names, known.output_names)
        )

    @property
    def kernels(self) -> list[str]:
        """The kernels of `driven_inputs` that the program calls."""
        driven = ["apply_drivers"] if len(self.drivers.kinds) else []
        return ["setpoints_at", "cut_segments", "merge_columns", *driven]

    @property
    def numbers(self) -> dict[str, float]:
        """Sample time and end of the run [s], number of samples, and the distance [s] within which
        a row is replaced by one at an instant of a driver."""
        step = float(self.prepared.loop.sample_time)
        instants = self.prepared.instants
        samples = len(instants) - 1
        finish = float(instants[-1])
        return {"sample_time": step, "samples": samples, "finish": finish, "near": CLOSE * step}

    def data(self, known: Description) -> dict[str, Any]:
        """What a program states of its loop: names in tuples, numbers in arrays; states of the
        drivers at rest.
        """
        printed = self.controller
        signal = self.prepared.setpoint_signal
        table = self.drivers
        return {
            **self.numbers,
            "columns": sum(self.added_columns, ()),
            "setpoints": tuple(printed.law.setpoints),
            "measured_at": np.array(self.measured_at(known), dtype=int).reshape(-1, 2),
            "commanded": self.prepared.commanded,
            "initial_memory": printed.initial_memory,
            "parameters": printed.paths,
            "parameter_defaults": printed.defaults,
            **printed.bounds.data,
            "setpoint": {"ends": signal.ends, "values": signal.values, "slopes": signal.slopes},
            "drivers": {"kinds": table.kinds, "settings": table.settings, "states": table.kept},
        }


def places_of(names: Iterable[str], groups: Sequence[Sequence[str]]) -> list[tuple[int, int]]:
    """Of each name: the number of the first group that has it, and its number there."""
    return [
        next((k, list(of).index(name)) for k, of in enumerate(groups) if name in of)
        for name in names
    ]


def export_loop(
    problem: Problem, name: str, title: str, tunable: Sequence[str] | None
) -> ExportedLoop:
    """The control loop of a problem, ready for a target, with the name and the tunable parameters
    of its controller.

    Raises ParameterError for what cannot be printed, by its name: a controller in Python, a driver
    of another kind, and a run that continues another.
    """
    problem = with_printable_controller(problem)
    loop = check_control_law(problem)
    if problem.control_state is not None:
        raise ParameterError(
            "a run that continues another cannot be exported, because the program begins with the"
            " first sample of the loop; leave control_state out."
        )
    for command, chain in loop.driven_inputs.chains.items():
        for driver in chain:
            if type(driver) not in KINDS:
                raise ParameterError(
                    f"the driver {type(driver).__name__} of '{command}' has no printed form; there"
                    f" are {', '.join(kind.__name__ for kind in KINDS)}. Export the controller"
                    " alone, or the plant with input signals."
                )
    prepared = prepare_loop(problem, loop.init(problem.start_time))
    capacity = sampled_loop.max_capacity(prepared)
    if capacity > MAX_CAPACITY:
        raise ParameterError(
            f"the drivers make up to {capacity} segments of an input between two samples;"
            f" {MAX_CAPACITY} are allowed. Lower the frequency of the carrier, or shorten the"
            " sample time."
        )
    near = CLOSE * loop.sample_time
    other_inputs = snapped(
        loop.other_inputs, prepared.input_names, prepared.instants, near
    ).as_floats()
    other_inputs.values[:, prepared.commanded] = other_inputs.slopes[:, prepared.commanded] = 0.0
    printed = print_any_controller(prepared, name, title, tunable)
    drivers = DriverTable(prepared, loop.init(problem.start_time), capacity)
    return ExportedLoop(printed, prepared, other_inputs, drivers, capacity)


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedRun:
    """A problem ready for a target, with its control loop if it has one.

    segments   of the inputs, whose drivers are resolved; in a loop, of those that are not commanded
    times      (N,) of the rows [s]
    columns    what is written after time
    """

    name: str
    system: ExportedSystem
    problem: Problem
    integrator: Integrator
    segments: PiecewiseLinear
    times: Array
    provenance: Sequence[str]
    columns: Sequence[str]
    loop: ExportedLoop | None

    @property
    def tolerance(self) -> float | None:
        """Relative tolerance of the integrator; None for one without."""
        return self.integrator.rtol if isinstance(self.integrator, Rodas4) else None

    @property
    def first_inputs(self) -> list[float]:
        """The inputs at the beginning of the run."""
        return list(map(float, self.segments.values[0]))

    def data(self) -> dict[str, Any]:
        """What a program states of its system and run: names in tuples, numbers in arrays."""
        system = self.system
        known = self.system.known
        problem = self.problem
        segments = self.segments
        return {
            "states": known.state_names,
            "inputs": known.input_names,
            "outputs": known.output_names,
            "units": system.units,
            "parameters": tuple(system.paths),
            "defaults": system.defaults,
            **ParameterBounds.of(system.tunable).data,
            "nominal": system.compiled.nominal,
            "input_minimum": known.input_minimum,
            "input_maximum": known.input_maximum,
            "run": {
                "initial": problem.initial_vector,
                "start": problem.start_time,
                "times": self.times,
                "segments": {
                    "ends": segments.ends,
                    "values": segments.values,
                    "slopes": segments.slopes,
                },
            },
        }
