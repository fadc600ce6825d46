"""Run of an exported program: its signals and times as numbers, its solver as text, and its control loop."""

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import Array, ParameterError
from ...engine.compile.kernel_text.printer import KernelPrinter
from ...engine.compile.kernel_text.types import TypedKernel
from ...engine.loop import COMMAND, MEASURED, SETPOINT, ControlLoop, PiecewiseLinear, WithDrivers
from ...engine.run import Problem
from ...engine.run.driver_table import KINDS, MAX_CAPACITY, DriverTable, greatest_capacity
from ...engine.run.integrators import ExplicitRungeKutta, Integrator, Rodas4
from ...engine.run.sampled_loop import CLOSE, SampledLoop, prepare_loop, snapped
from .printed_controller import PrintedController, check_control_law, print_controller
from .printed_system import ExportedSystem


@dataclasses.dataclass(frozen=True, eq=False)
class RunData:
    """A run: `initial` (n,), the segments of the inputs, in a control loop of those that are not commanded, and `times`
    (N,) of the rows, from `start` [s] on."""

    initial: Array
    segments: PiecewiseLinear
    times: Array
    start: float
    integrator: Integrator


def run_data(problem: Problem, segments: PiecewiseLinear | None = None, times: Array | None = None) -> RunData:
    """The run of a problem with input signals, whose drivers are resolved into segments; with a control loop, the
    segments of the inputs that are not commanded, and the output times, are given."""
    assert problem.integrator is not None
    return RunData(
        problem.initial_vector, problem.segments if segments is None else segments,
        problem.times if times is None else times, problem.start_time, check_integrator(problem.integrator),
    )  # fmt: skip


def program_data(system: ExportedSystem, run: RunData) -> dict[str, Any]:
    """What a program states of its system and run: names in tuples, numbers in arrays."""
    known, segments = system.compiled.description, run.segments
    return {
        "states": tuple(system.state_names), "inputs": tuple(system.input_names), "outputs": tuple(system.output_names),
        "units": system.units, "parameters": tuple(leaf.path for leaf in system.tunable),
        "defaults": system.defaults, "nominal": system.nominal,
        "input_minimum": known.input_minimum, "input_maximum": known.input_maximum,
        "run": {
            "initial": run.initial, "start": run.start, "times": run.times,
            "segments": {"ends": segments.ends, "values": segments.values, "slopes": segments.slopes},
        },
    }  # fmt: skip


def check_integrator(integrator: Integrator) -> Integrator:
    """The integrator. Raises ParameterError for one that has no printed form."""
    if not integrator.printed_step:
        raise ParameterError(
            f"the integrator {type(integrator).__name__} has no printed form; choose Rodas4, RungeKutta4 or "
            "DormandPrince8."
        )
    return integrator


def check_open_loop(problem: Problem) -> None:
    """Raise ParameterError for a problem with a controller."""
    if isinstance(problem.input, ControlLoop):
        raise ParameterError(
            f"the controller {type(problem.input.controller).__name__} cannot be exported to this target; export the "
            "plant with input signals, or the loop to C, JavaScript, Octave, or as FMUs of an SSP package."
        )


def tableau_arrays(integrator: ExplicitRungeKutta) -> tuple[Array, Array, Array]:
    """Rows (s, s), weights (s,) and nodes (s,) of an explicit method."""
    rows, weights = integrator.tableau()
    count = len(weights)
    table = np.zeros((count, count))
    for i, row in enumerate(rows, 1):
        table[i, : len(row)] = row
    return table, np.array(weights), np.array([0.0, *(sum(row) for row in rows)])


SHAPES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(
        (
            "y", "yn", "x", "g", "f0", "ft", "k1", "k2", "k3", "k4", "k5", "k6", "d2", "d3", "absolute", "nominal",
            "between",
        ),
        ("STATES",),
    ),
    **dict.fromkeys(("u", "w", "base"), ("INPUTS",)), **dict.fromkeys(("nodes", "weights"), ("STAGES",)),
    "k": ("STAGES", "STATES"), "table": ("STAGES", "STAGES"), "jacobian": ("JACOBIAN",), "factors": ("FACTORS",),
}  # fmt: skip
"""Sizes of the arrays of the kernels of integrators."""
TABLEAU = ("table", "weights", "nodes")
"""Arguments that are the tableau of an explicit method."""
STEP = {
    "y": "x", "base": "u", "w": "w", "moving": "moving", "t": "t", "start": "start", "end": "end", "h": "h",
    "relative": "rtol", "done": "done", "d2": "d2", "d3": "d3", "c": "c", "nominal": "nominal",
    **dict(zip(TABLEAU, TABLEAU, strict=True)),
}  # fmt: skip
"""Fields of the solver for the arguments of `single_step`."""
BETWEEN = {**STEP, "y": "x_before", "yn": "x", "t": "t_before", "h": "h_taken"}
"""Fields of the solver for the arguments of `state_between`."""
RESULTS = ("result", "reached", "taken", "following", "rejections")
"""Results of `single_step`."""


@dataclasses.dataclass(frozen=True, eq=False)
class SolverText:
    """The step of an integrator in a language.

    fields   the text of each field of the solver that STEP and BETWEEN name
    sizes    the text of each size in SHAPES
    work     what stands before the names of arrays of the workspace
    """

    printer: KernelPrinter
    integrator: Integrator
    fields: Mapping[str, str]
    sizes: Mapping[str, str]
    work: str = ""

    @functools.cached_property
    def _kernels(self) -> dict[str, TypedKernel]:
        return self.printer.typed(self.integrator.printed_step, ("single_step", "state_between"))

    @property
    def implicit(self) -> bool:
        """Whether the step needs the Jacobian."""
        return "jac" in self._kernels["single_step"].called

    @property
    def constants(self) -> dict[str, Any]:
        """First step (0: to be found), distance within which a time belongs to a step, relative tolerance, and the
        tableau that the step reads."""
        own = self.integrator
        if not isinstance(own, ExplicitRungeKutta):
            return {"FIRST_STEP": 0.0, "CLOSE": 0.0, "RTOL": own.rtol if isinstance(own, Rodas4) else 0.0}
        read = self._kernels["single_step"].arguments
        tableau = {key.upper(): value for key, value in zip(TABLEAU, tableau_arrays(own), strict=True) if key in read}
        return {"FIRST_STEP": own.step, "CLOSE": 1e-9 * own.step, "RTOL": 0.0, **tableau}

    @property
    def places(self) -> dict[str, str]:
        """The printed functions, and their calls with their workspace, for a template."""
        result = {"steps": self.printer.printed(self._kernels)}
        for name, fields, results in (("single_step", STEP, RESULTS), ("state_between", BETWEEN, ())):
            kernel = self._kernels[name]
            given = {key: self.fields[field] for key, field in fields.items()}
            own = [key for key in kernel.arguments if key in SHAPES and key not in {*given, "between"}]
            work = {key: [self.sizes[size] for size in SHAPES[key]] for key in own}
            result[f"{name}_work"] = self.printer.workspace(work)
            given |= {key: f"{self.work}{key}" for key in own}
            result[name] = self.printer.bound_call(kernel, given, results)
        return result


CONTROLLER = "controller."
"""Beginning of the paths of the parameters of a controller among those of its loop."""


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedLoop:
    """A control loop with its run.

    controller  the control law; the plant is in the system of the program
    others      segments of the inputs that are not commanded; an end near a sampling instant is at it
    """

    controller: PrintedController
    prepared: SampledLoop
    others: PiecewiseLinear
    drivers: DriverTable
    capacity: int

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.prepared.instants) - 1

    @property
    def sample_time(self) -> float:
        """Time between two samples [s]."""
        return float(self.prepared.loop.sample_time)

    @property
    def near(self) -> float:
        """The distance [s] within which a row is replaced by one at an instant of a driver."""
        return CLOSE * self.sample_time

    @property
    def added_columns(self) -> tuple[str, ...]:
        """The columns of set points, measurements and commands."""
        law = self.controller.law
        kinds = zip((SETPOINT, MEASURED, COMMAND), (law.setpoints, law.measured_columns, law.inputs), strict=True)
        return tuple(f"{kind}{name}" for kind, names in kinds for name in names)

    def measured_at(self, system: ExportedSystem) -> list[tuple[int, int]]:
        """Of each measured column: 0 for a state and 1 for an output, and its number among these."""
        names = system.state_names, system.output_names
        return [
            next((k, of.index(n)) for k, of in enumerate(names) if n in of)
            for n in self.controller.law.measured_columns
        ]

    def column_at(self, system: ExportedSystem, columns: Sequence[str]) -> list[tuple[int, int]]:
        """Of each column: its kind (state, input, output, set point, measurement, command), and its number."""
        law = self.controller.law
        groups = (
            system.state_names, system.input_names, system.output_names,
            [f"{SETPOINT}{n}" for n in law.setpoints], [f"{MEASURED}{n}" for n in law.measured_columns],
            [f"{COMMAND}{n}" for n in law.inputs],
        )  # fmt: skip
        return [next((k, list(of).index(n)) for k, of in enumerate(groups) if n in of) for n in columns]

    @property
    def kernels(self) -> list[str]:
        """The kernels of `driven_inputs` that the program calls."""
        return [
            "setpoints_at",
            "cut_segments",
            "merge_columns",
            *(["apply_drivers"] if len(self.drivers.kinds) else []),
        ]

    def data(self, system: ExportedSystem) -> dict[str, Any]:
        """What a program states of its loop: names in tuples, numbers in arrays; states of the drivers at rest."""
        law, signal, table, tunable = (
            self.controller.law, self.prepared.setpoint_signal, self.drivers, self.controller.tunable
        )  # fmt: skip
        return {
            "sample_time": self.sample_time, "samples": self.samples, "finish": float(self.prepared.instants[-1]),
            "near": self.near, "columns": self.added_columns, "setpoints": tuple(law.setpoints),
            "measured_at": np.array(self.measured_at(system), dtype=int).reshape(-1, 2),
            "commanded": self.prepared.commanded,
            "initial_memory": np.array([float(value) for value in law.initial_memory.values()]),
            "parameters": tuple(leaf.path for leaf in tunable),
            "parameter_defaults": np.array([float(leaf.value) for leaf in tunable]),
            "setpoint": {"ends": signal.ends, "values": signal.values, "slopes": signal.slopes},
            "drivers": {"kinds": table.kinds, "settings": table.settings, "states": table.kept},
        }  # fmt: skip


def export_loop(problem: Problem, name: str, title: str, tunable: Sequence[str] | None) -> ExportedLoop:
    """The control loop of a problem, ready for a target; `name` is that of the printed controller.

    tunable  paths of the parameters of the controller that can be changed, without `controller.`; None: all

    Raises ParameterError for what cannot be printed, by its name: a controller in Python, a driver of another kind, and
    a run that continues another.
    """
    loop = check_control_law(problem)
    if problem.control_state is not None:
        raise ParameterError(
            "a run that continues another cannot be exported, because the program begins with the first sample of the "
            "loop; leave control_state out."
        )
    check_drivers(loop)
    prepared = prepare_loop(problem, loop.init(problem.start_time))
    capacity = greatest_capacity(prepared)
    if capacity > MAX_CAPACITY:
        raise ParameterError(
            f"the drivers make up to {capacity} segments of an input between two samples; {MAX_CAPACITY} are allowed. "
            "Lower the frequency of the carrier, or shorten the sample time."
        )
    edges = prepared.instants
    others = snapped(loop.other_inputs, prepared.input_names, edges, CLOSE * loop.sample_time).as_floats()
    others.values[:, prepared.commanded] = others.slopes[:, prepared.commanded] = 0.0
    printed = print_controller(prepared, name, title, tunable)
    return ExportedLoop(
        printed, prepared, others, DriverTable(prepared, loop.init(problem.start_time), capacity), capacity
    )


def check_drivers(loop: ControlLoop) -> None:
    """Raise ParameterError for a driver that has no printed form, by its name."""
    for name, chain in WithDrivers(loop.other_inputs, loop.drivers).chains.items():
        for driver in chain:
            if type(driver) not in KINDS:
                raise ParameterError(
                    f"the driver {type(driver).__name__} of '{name}' has no printed form; there are "
                    f"{', '.join(kind.__name__ for kind in KINDS)}. Export the controller alone, or the plant with "
                    "input signals."
                )
