"""Building of exported C with a compiler of the machine: a program, its output, and the size of its code and stack."""

from __future__ import annotations

import dataclasses
import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from ...core.atomic_output import temporary_folder
from .compiler import find_compiler, run_command


@dataclasses.dataclass(frozen=True)
class BuiltProgram:
    """Output of an exported program, and the bytes of its code and stack with optimisation for size.

    output      standard output
    messages    standard error
    code_size   [bytes] machine code and constants of the sources without `main.c`; None where the program `size` is
                missing
    stack_size  [bytes] of the functions of the sources without `main.c` together, without those of the C library; None
                where it is not known
    """

    output: str
    messages: str
    code_size: int | None
    stack_size: int | None = None


def build_and_run(sources: Sequence[Path]) -> BuiltProgram:
    """Compile exported C sources in a temporary folder and run the program; the folder of the sources is unchanged.

    Raises ParameterError where there is no compiler, and FileError where the compiler or the program fails.
    """
    files = " ".join(p.name for p in sources if p.suffix == ".c")
    compiler = find_compiler(
        f". The sources are in {sources[0].parent}; install gcc or clang, or compile them elsewhere: cc -O2 {files} "
        "-lm -o program. JavaScript and Octave need no compiler."
    )
    with temporary_folder() as folder:
        program, units = folder / "program", [str(p) for p in sources if p.suffix == ".c"]
        run_command([compiler, "-std=c99", "-O2", "-ffp-contract=off", *units, "-o", str(program), "-lm"])
        done = run_command([str(program)])
        code, _ = measure_sizes([compiler], shutil.which("size"), sources, folder)
        return BuiltProgram(done.stdout, done.stderr, code)


def measure_sizes(
    command: Sequence[str], size: str | None, sources: Sequence[Path], folder: Path
) -> tuple[int | None, int | None]:
    """The bytes of machine code and constants, and of the stack, of sources without `main.c`, optimised for size.

    command  compiler and its options
    size     the program `size` of the compiler
    """
    units = [p for p in sources if p.suffix == ".c" and p.name != "main.c"]
    if not units:
        return None, None
    code, stack = 0, 0
    options = ["-std=c99", "-Os", "-ffp-contract=off", "-fstack-usage", "-c"]
    for unit in units:
        target = folder / f"{unit.stem}.o"
        run_command([*command, *options, str(unit), "-o", str(target)])
        numbers = re.search(r"^\s*(\d+)", run_command([size, str(target)]).stdout, re.MULTILINE) if size else None
        code += int(numbers.group(1)) if numbers else 0
        usage = target.with_suffix(".su")
        text = usage.read_text() if usage.exists() else ""
        stack += sum(int(n) for n in re.findall(r"\t(\d+)\t", text))
    return code or None, stack or None
