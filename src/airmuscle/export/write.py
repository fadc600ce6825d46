"""Writing of exported programs and laws into a folder; all files of an export appear, or none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..characteristic import Characteristic
from ..core.errors import ParameterError, suggestion
from ..report.output_folder import atomic_folder
from ..simulation import Problem
from .identifiers import make_identifier
from .law import print_law
from .printed_system import export_system
from .provenance import provenance
from .run_data import check_open_loop, run_data
from .targets import C99, ExportedRun, Target, program_name

NOTE = (
    "The equations are those of the model. The program does not report where a run leaves the validity range of a "
    "characteristic or of another component, as a simulation by airmuscle does."
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

    problem  a system with its input signals, initial state, output times and integrator
    target   C99(), JavaScript() or Octave()
    name     name of the files, and beginning of the names in them; by default the title
    tunable  paths of the parameters that the program can change; all by default, the others become constants
    columns  states, inputs and outputs that the run writes after time; all by default

    The files depend on the arguments and the version of airmuscle alone. Raises ParameterError for what cannot be
    exported, which it names, and FileError.
    """
    program = make_run(problem, name=name, title=title, tunable=tunable, columns=columns)
    return write_files(target.run_files(program), folder)


def make_run(
    problem: Problem, *, name: str = "", title: str = "", tunable: Sequence[str] | None = None,
    columns: Sequence[str] = (), notes: Sequence[str] = (NOTE,),
) -> ExportedRun:  # fmt: skip
    """A problem ready for any target; arguments and errors as for `write_program`."""
    check_open_loop(problem)
    run, title = run_data(problem), title or type(problem.system).__name__
    system = export_system(problem.compiled, tunable)
    for column in columns:
        if column not in system.columns:
            raise ParameterError(
                f"the run has no column '{column}'; there are {', '.join(system.columns)}."
                f"{suggestion(column, system.columns)}"
            )
    lines = provenance(title, problem.system, (run.integrator,), notes)
    chosen = tuple(c for c in columns if c != "time") or system.columns
    return ExportedRun(checked_name(name) or program_name(title), system, run, lines, chosen)


def write_law(
    law: Characteristic, folder: str | Path, target: Target = C99(), *, name: str = "", title: str = ""
) -> tuple[Path, ...]:
    """Write a static characteristic with its slopes as a function in another language; the paths of its files.

    A force law gives force [N], its derivative by pressure [N/Pa] and stiffness -dF/deps [N]; a law that is given as
    contraction or pressure gives this and its two derivatives. Raises ParameterError for a law without closed form, and
    FileError.
    """
    title = title or type(law).__name__
    return write_files(target.law_files(print_law(law, checked_name(name) or program_name(title), title)), folder)


def checked_name(name: str) -> str:
    """A name given by the user. Raises ParameterError, with a name that is possible, if it is not an identifier."""
    if name and make_identifier(name) != name:
        raise ParameterError(
            f"'{name[:80]}' cannot be the name of an exported program: it must consist of ASCII letters, digits and "
            f"single underscores, begin with a letter, and be no keyword. Use '{make_identifier(name)}'."
        )
    return name


def write_files(files: Mapping[str, str], folder: str | Path) -> tuple[Path, ...]:
    """Write texts by file name into a folder, all or none; their paths. Raises FileError."""
    target = Path(folder)
    with atomic_folder(target) as staging:
        for file, text in files.items():
            (staging / file).write_bytes(text.encode("utf-8", "replace"))
    return tuple(target / file for file in files)
