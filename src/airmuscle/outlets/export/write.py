"""Writing of exported programs and laws into a folder; all files of an export appear, or none."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...core import ParameterError, atomic_folder, check_known
from ...engine.loop import (
    MEASURED,
    ControlLoop,
    EnclosingLaw,
    WithSensors,
    without_simulated,
)
from ...engine.run import Problem, solve
from ...engine.run.batch.lanes import Double, Precision, Single
from ...engine.run.sampled_loop import prepare_loop
from ...physics.muscle.characteristic import Characteristic
from .exported_run import CONTROLLER, ExportedRun, export_loop
from .identifiers import program_name, provenance
from .printed_predictive import (
    check_control_law,
    print_any_controller,
    with_printable_controller,
)
from .printed_system import export_system
from .targets import C99, Target, print_law

NOTE = (
    "The equations are those of the model. The program does not report where a run leaves the"
    " validity range of a characteristic or of another component, as a simulation by airmuscle"
    " does."
)
"""What an exported program does not contain."""


def write_program(
    problem: Problem,
    folder: str | Path,
    target: Target = C99(),
    *,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] | None = None,
    columns: Sequence[str] = (),
) -> tuple[Path, ...]:
    """Write a system and its run as a program in another language; returns the paths of its files.

    problem  a system with its input signals or a control loop, initial state, output times and
             integrator
    target   C99(), JavaScript() or Octave()
    name     name of the files, and beginning of the names in them; by default the title
    tunable  paths of the parameters that the program can change, those of a controller with
             `controller.` before them; all by default, the others become constants
    columns  states, inputs, outputs and columns of a controller that the run writes after time; all
             by default

    The files depend on the arguments and the version of airmuscle alone. Raises ParameterError for
    what cannot be exported, which it names, and FileError.
    """
    program = make_run(
        problem, name=name, title=title, tunable=tunable, columns=columns, with_loop=True
    )
    return write_files(target.run_files(program), folder)


def make_run(
    problem: Problem,
    *,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] | None = None,
    columns: Sequence[str] = (),
    notes: Sequence[str] = (NOTE,),
    with_loop: bool = False,
) -> ExportedRun:
    """A problem ready for any target, with its control loop if the target has one; else as for
    `write_program`.
    """
    title = title or type(problem.system).__name__
    name = program_name(name, title)
    loop = None
    of_plant = tunable
    if isinstance(problem.input, ControlLoop):
        if not with_loop:
            raise ParameterError(
                f"the controller {type(problem.input.controller).__name__} cannot be exported to"
                " this target; export the plant with input signals, or the loop to C, JavaScript,"
                " Octave, or as FMUs of an SSP package."
            )
        of_controller = None
        if tunable is not None:
            of_plant = [path for path in tunable if not path.startswith(CONTROLLER)]
            of_controller = [
                path.removeprefix(CONTROLLER) for path in tunable if path.startswith(CONTROLLER)
            ]
        loop = export_loop(problem, f"{name}_controller", title, of_controller)
    integrator = problem.integrator
    if integrator is None or not integrator.printed_step:
        raise ParameterError(
            f"the integrator {type(integrator).__name__} has no printed form; choose Rodas4,"
            " RungeKutta4 or DormandPrince8."
        )
    system = export_system(problem.compiled, of_plant)
    known = sum(loop.added_columns if loop else (), system.known.column_names)
    check_known("the run has no column", columns, known)
    lines = provenance(title, problem.system, (integrator,), notes)
    segments, times = (
        (loop.others, loop.prepared.times) if loop else (problem.segments, problem.times)
    )
    written = tuple(c for c in columns if c != "time") or known
    return ExportedRun(name, system, problem, integrator, segments, times, lines, written, loop)


def write_law(
    law: Characteristic,
    folder: str | Path,
    target: Target = C99(),
    *,
    name: str = "",
    title: str = "",
) -> tuple[Path, ...]:
    """Write a static characteristic with its slopes as a function in another language; the paths of
    its files.

    A force law gives force [N], its derivative by pressure [N/Pa] and stiffness -dF/deps [N]; a law
    that is given as contraction or pressure gives this and its two derivatives. Raises
    ParameterError for a law without closed form, and FileError.
    """
    title = title or type(law).__name__
    return write_files(target.law_files(print_law(law, program_name(name, title), title)), folder)


def write_files(
    files: Mapping[str, str] | Mapping[str, str | bytes], folder: str | Path
) -> tuple[Path, ...]:
    """Write texts or bytes by file name into a folder, all or none; their paths. Raises
    FileError.
    """
    target = Path(folder)
    with atomic_folder(target) as staging:
        for file, text in files.items():
            (staging / file).parent.mkdir(parents=True, exist_ok=True)
            content = text if isinstance(text, bytes) else text.encode("utf-8", "replace")
            (staging / file).write_bytes(content)
    return tuple(target / file for file in files)


PRECISIONS: dict[str, Precision] = {"double": Double(), "float": Single()}
"""Precisions of the arithmetic of exported controllers, by the names of the type in C."""
LEFT_OUT = (
    "Not part of this program: simulated sensors and faults of the scenario (resolution, noise,"
    " lag, delay); the measurements are those of the real sensors."
)
"""Note on simulated sensors and faults."""


def write_controller(
    problem: Problem,
    folder: str | Path,
    *,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] = (),
    precision: Precision = Double(),
    arduino: bool = False,
) -> tuple[Path, ...]:
    """Write the control law of a problem as C99 for a microcontroller; returns the paths of its
    files.

    problem  a plant with a ControlLoop; the run is simulated, and its measurements are the data of
             the replay. Simulated sensors and faults (`WithSensors`, `WithStuckValve`) belong to
             the plant and are left out, at any depth of the law; the readings of sensors around the
             whole law are the data of the replay
    tunable  paths of the parameters that remain variables; none by default: all are constants of
             the program
    precision  Double(), or Single() for a processor that computes with floats alone
    arduino  whether the files are an Arduino library with an example sketch, in place of the
             program of the replay

    The function is `NAME_step(memory, measurement, setpoint, command)`. Sample time and ranges of
    the commands are constants. The program `main.c` replays the measurements of the run. In double
    precision it compares the commands bit by bit with those of the same operations in IEEE 754; in
    single precision they differ from these by at most 1e-4 of the range of the command. The program
    of a LinearModelPredictive contains the solver of its quadratic program; in double precision its
    commands differ from those of Python by at most 1e-9 of their range.

    Raises ParameterError for a problem without a controller, a controller that is neither a
    ControlLaw nor a LinearModelPredictive, and one that single precision changes by more;
    SimulationError if the run fails, and FileError.
    """
    problem = with_printable_controller(problem)
    loop = check_control_law(problem)
    prepared = prepare_loop(problem, loop.init(problem.start_time))
    law = without_simulated(loop.controller)
    of_real_plant = dataclasses.replace(prepared, loop=dataclasses.replace(loop, controller=law))
    notes = () if law == loop.controller else (LEFT_OUT,)
    name = program_name(name, title or type(law).__name__)
    number = "float" if precision == Single() else "double"
    printed = print_any_controller(of_real_plant, name, title, tunable, number, notes)
    recording = solve(problem).raise_if_incomplete().recording
    rows = np.searchsorted(recording["time"], prepared.instants[:-1] - 1e-9 * loop.sample_time)
    measured = np.column_stack(
        [recording[f"{MEASURED}{column}"][rows] for column in loop.controller.measured_columns]
    )
    enclosing = loop.controller
    setpoints = prepared.setpoint_values
    while (
        isinstance(enclosing, EnclosingLaw) and enclosing.simulated
    ):  # simulated sensors around the law
        measured = (
            enclosing.readings(measured, loop.sample_time)
            if isinstance(enclosing, WithSensors)
            else measured
        )
        enclosing = enclosing.law
    commands = printed.replay(measured, setpoints)
    if precision == Single():
        printed.check_single_precision(measured, setpoints, commands, loop.sample_time)
    if arduino:
        return write_files(printed.arduino_files(loop.sample_time, setpoints[0].tolist()), folder)
    return write_files(printed.files(measured, setpoints, commands), folder)
