"""Exported control loop: a control law, its drivers, and the signals of a run, ready for a target."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.errors import ParameterError
from ...engine.loop.control_loop import COMMAND, MEASURED, SETPOINT, ControlLoop
from ...engine.loop.driver import WithDrivers
from ...engine.loop.piecewise_linear import PiecewiseLinear
from ...engine.run import Problem
from ...engine.run.driver_table import KINDS, MAX_CAPACITY, DriverTable, greatest_capacity
from ...engine.run.sampled_loop import CLOSE, SampledLoop, prepare_loop, snapped
from .printed_controller import PrintedController, check_control_law, print_controller
from .printed_system import ExportedSystem

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
