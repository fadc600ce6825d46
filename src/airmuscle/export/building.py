"""Building of exported C with the compiler of the machine: a program, its output, and the size of its code."""

from __future__ import annotations

import dataclasses
import re
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from .compiler import find_compiler, run_command


@dataclasses.dataclass(frozen=True)
class BuiltProgram:
    """Output of an exported program, and the bytes of its machine code and constants with optimisation for size.

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
    files = " ".join(p.name for p in sources if p.suffix == ".c")
    compiler = find_compiler(
        f". The sources are in {sources[0].parent}; install gcc or clang, or compile them elsewhere: cc -O2 {files} "
        "-lm -o program. JavaScript and Octave need no compiler."
    )
    with tempfile.TemporaryDirectory() as folder:
        program, units = Path(folder) / "program", [str(p) for p in sources if p.suffix == ".c"]
        run_command([compiler, "-std=c99", "-O2", "-ffp-contract=off", *units, "-o", str(program), "-lm"])
        done = run_command([str(program)])
        return BuiltProgram(done.stdout, done.stderr, _code_size(compiler, sources, Path(folder)))


def _code_size(compiler: str, sources: Sequence[Path], folder: Path) -> int | None:
    size, target = shutil.which("size"), folder / "program.o"
    source = next((p for p in sources if p.suffix == ".c" and p.name != "main.c"), None)
    if size is None or source is None:
        return None
    run_command([compiler, "-std=c99", "-Os", "-ffp-contract=off", "-c", str(source), "-o", str(target)])
    numbers = re.search(r"^\s*(\d+)", run_command([size, str(target)]).stdout, re.MULTILINE)
    return int(numbers.group(1)) if numbers else None
