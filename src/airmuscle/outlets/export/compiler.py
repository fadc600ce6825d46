"""C compiler of the machine, for programs and shared libraries of exported sources."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...core.atomic_output import temporary_folder
from ...core.errors import FileError, ParameterError

COMPILERS = ("gcc", "clang", "cc")
OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden", "-s")
"""No contraction of products and sums: the numbers are those of the library on every processor."""
TIME_LIMIT = 600.0
"""Time [s] after which a compiler or a program is stopped (chosen)."""


def compile_library(sources: Mapping[str, bytes], units: Sequence[str], name: str, more: Sequence[str] = ()) -> bytes:
    """The shared library `name` of the files `units` among `sources`, compiled in a fresh folder.

    more  further arguments of the compiler

    Raises ParameterError where there is no compiler, FileError where it fails.
    """
    return compile_with([find_compiler()], sources, units, name, more)


def compile_with(
    command: Sequence[str], sources: Mapping[str, bytes], units: Sequence[str], name: str, more: Sequence[str] = ()
) -> bytes:
    """The same with a compiler and its first arguments."""
    with temporary_folder() as folder:
        for file, text in sources.items():
            (folder / file).write_bytes(text)
        run_command([*command, *OPTIONS, *units, "-o", name, *more, "-lm"], folder)
        return (folder / name).read_bytes()


def find_compiler(remedy: str = "; install the package gcc or clang") -> str:
    """The path of a C compiler. Raises ParameterError, whose text ends with `remedy`."""
    for name in COMPILERS:
        path = shutil.which(name)
        if path:
            return path
    raise ParameterError(f"no C compiler ({', '.join(COMPILERS)}) was found{remedy}")


def run_command(command: Sequence[str], folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a compiler or a program in a folder. Raises FileError with its message if it fails or takes too long."""
    name = command[3] if list(command[1:3]) == ["-P", "-m"] else Path(command[0]).name  # a program that is a package
    try:
        done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True, timeout=TIME_LIMIT)
    except subprocess.TimeoutExpired:
        raise FileError(f"{name} was stopped after {TIME_LIMIT:g} s.") from None
    if done.returncode:
        reason = " ".join((done.stderr or done.stdout).split())[:300]
        raise FileError(f"{name} failed with exit code {done.returncode}: {reason}")
    return done
