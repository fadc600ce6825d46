"""Controller on a microcontroller: a control law as a C99 function, with a program that replays a recorded run."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.arrays import Array
from ...engine.loop.control_law import EnclosingLaw, without_simulated
from ...engine.loop.control_loop import MEASURED
from ...engine.loop.controller import Controller
from ...engine.loop.sensors import WithSensors
from ...engine.run import Problem, solve
from ...engine.run.batch.lanes import Double, Precision, Single
from ...engine.run.sampled_loop import prepare_loop
from .printed_controller import check_control_law, check_single_precision, print_controller
from .targets import program_name
from .write import checked_name, write_files

PRECISIONS: dict[str, Precision] = {"double": Double(), "float": Single()}
"""Precisions of the arithmetic of exported controllers, by the names of the type in C."""
LEFT_OUT = (
    "Not part of this program: simulated sensors and faults of the scenario (resolution, noise, lag, delay); the "
    "measurements are those of the real sensors."
)
"""Note on simulated sensors and faults."""


def write_controller(
    problem: Problem, folder: str | Path, *, name: str = "", title: str = "", tunable: Sequence[str] = (),
    precision: Precision = Double(), arduino: bool = False,
) -> tuple[Path, ...]:  # fmt: skip
    """Write the control law of a problem as C99 for a microcontroller; returns the paths of its files.

    problem  a plant with a ControlLoop; the run is simulated, and its measurements are the data of the replay.
             Simulated sensors and faults (`WithSensors`, `WithStuckValve`) belong to the plant and are left out, at any
             depth of the law; the readings of sensors around the whole law are the data of the replay
    tunable  paths of the parameters that remain variables; none by default: all are constants of the program
    precision  Double(), or Single() for a processor that computes with floats alone
    arduino  whether the files are an Arduino library with an example sketch, in place of the program of the replay

    The function is `NAME_step(memory, measurement, setpoint, command)`. Sample time and ranges of the commands are
    constants. The program `main.c` replays the measurements of the run. In double precision it compares the commands
    bit by bit with those of the same operations in IEEE 754; in single precision they differ from these by at most 1e-4
    of the range of the command. Raises ParameterError for a problem without a controller, a controller that is not a
    ControlLaw, and one that single precision changes by more; SimulationError if the run fails, and FileError.
    """
    loop = check_control_law(problem)
    prepared = prepare_loop(problem, loop.init(problem.start_time))
    law = without_simulated(loop.controller)
    of_real_plant = dataclasses.replace(prepared, loop=dataclasses.replace(loop, controller=law))
    notes = () if law == loop.controller else (LEFT_OUT,)
    printed = print_controller(of_real_plant, checked_name(name) or program_name(title or type(law).__name__), title,
                               tunable, "float" if precision == Single() else "double", notes)  # fmt: skip
    recording = solve(problem).raise_if_incomplete().recording
    rows = np.searchsorted(recording["time"], prepared.instants[:-1] - 1e-9 * loop.sample_time)
    measured = np.column_stack([recording[f"{MEASURED}{column}"][rows] for column in loop.controller.measured_columns])
    measured = _readings(loop.controller, measured, loop.sample_time)
    samples = printed.replay(measured, prepared.setpoint_values)
    if precision == Single():
        check_single_precision(printed, samples, loop.sample_time)
    if arduino:
        return write_files(printed.arduino_files(loop.sample_time, prepared.setpoint_values[0].tolist()), folder)
    return write_files(printed.files(samples), folder)


def _readings(law: Controller, measured: Array, sample_time: float) -> Array:
    """The measurements (K, m) of a run behind the simulated sensors around its law."""
    while isinstance(law, EnclosingLaw) and law.simulated:
        measured = law.readings(measured, sample_time) if isinstance(law, WithSensors) else measured
        law = law.law
    return measured
