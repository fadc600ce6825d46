"""Building of exported C with the compiler of the machine: a program, what it printed, and the size of its code."""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ..core.errors import FileError, ParameterError

COMPILERS = ("cc", "gcc", "clang")
LIMIT = 600.0
"""Time [s] after which a compiler or a program is stopped (chosen)."""


@dataclasses.dataclass(frozen=True)
class BuiltProgram:
    """What an exported program printed, and the bytes of its machine code and constants with optimisation for size.

    output     standard output
    messages   standard error
    code_size  [bytes] of the source without `main.c`; None where the program `size` is missing
    """

    output: str
    messages: str
    code_size: int | None


def build_and_run(sources: Sequence[Path]) -> BuiltProgram:
    """Compile exported C sources in a temporary folder and run the program; the folder of the sources is unchanged.

    Raises ParameterError where there is no compiler, and FileError where the compiler or the program fails.
    """
    compiler = find_compiler(sources)
    with tempfile.TemporaryDirectory() as folder:
        program, files = Path(folder) / "program", [str(p) for p in sources if p.suffix == ".c"]
        _run([compiler, "-std=c99", "-O2", "-ffp-contract=off", *files, "-o", str(program), "-lm"])
        done = _run([str(program)])
        return BuiltProgram(done.stdout, done.stderr, _code_size(compiler, sources, Path(folder)))


def find_compiler(sources: Sequence[Path]) -> str:
    """The path of a C compiler. Raises ParameterError with what can be done without one."""
    for name in COMPILERS:
        path = shutil.which(name)
        if path:
            return path
    files = " ".join(p.name for p in sources if p.suffix == ".c")
    raise ParameterError(
        f"no C compiler ({', '.join(COMPILERS)}) was found. The sources are in {sources[0].parent}; install gcc or "
        f"clang, or compile them elsewhere: cc -O2 {files} -lm -o program. JavaScript and Octave need no compiler."
    )


def _code_size(compiler: str, sources: Sequence[Path], folder: Path) -> int | None:
    size, target = shutil.which("size"), folder / "program.o"
    source = next((p for p in sources if p.suffix == ".c" and p.name != "main.c"), None)
    if size is None or source is None:
        return None
    _run([compiler, "-std=c99", "-Os", "-ffp-contract=off", "-c", str(source), "-o", str(target)])
    numbers = re.search(r"^\s*(\d+)", _run([size, str(target)]).stdout, re.MULTILINE)
    return int(numbers.group(1)) if numbers else None


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        raise FileError(f"{command[0]} was stopped after {LIMIT:g} s.") from None
    if done.returncode:
        reason = " ".join((done.stderr or done.stdout).split())[:300]
        raise FileError(f"{Path(command[0]).name} failed with exit code {done.returncode}: {reason}")
    return done
