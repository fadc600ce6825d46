"""Microcontrollers: exported C compiled for an Arm Cortex-M, and run in the emulator QEMU."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Sequence
from pathlib import Path

from ...core.atomic_output import temporary_folder
from ...core.errors import ParameterError
from .building import BuiltProgram, measure_sizes
from .compiler import run_command
from .templates import template

COMPILER, SIZE, EMULATOR = "arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm"
PACKAGES = "gcc-arm-none-eabi, libnewlib-arm-none-eabi and qemu-system-arm"
"""The packages of Debian that contain compiler, C library and emulator."""


@dataclasses.dataclass(frozen=True)
class Processor:
    """A processor: the options of the compiler, and the board of QEMU on which a program is run."""

    options: tuple[str, ...]
    board: str


PROCESSORS = {
    "cortex-m4": Processor(("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"), "mps2-an386"),
    "cortex-m7": Processor(("-mcpu=cortex-m7", "-mfpu=fpv5-d16"), "mps2-an500"),
}
"""Processors by name: Cortex-M4 with a unit for single precision, Cortex-M7 with one for double precision."""


def run_in_emulator(sources: Sequence[Path], processor: Processor) -> BuiltProgram:
    """Compile exported C for a processor in a temporary folder and run it in QEMU; the output is that of the program.

    Raises ParameterError where compiler or emulator are missing, and FileError where one of them or the program fails.
    """
    for program in (COMPILER, EMULATOR):
        if shutil.which(program) is None:
            raise ParameterError(
                f"{program} was not found. The sources are in {sources[0].parent}; to compile and run them for a "
                f"microcontroller install the packages {PACKAGES} (names of Debian)."
            )
    command = [COMPILER, "-mthumb", "-mfloat-abi=hard", *processor.options]
    with temporary_folder() as folder:
        units = [str(p) for p in sources if p.suffix == ".c"]
        for file in ("cortex_m_startup.c", "cortex_m.ld"):
            (folder / file).write_text(template(file), encoding="utf-8")
        run_command([
            *command, "-std=c99", "-O2", "-ffp-contract=off", "-nostartfiles", "--specs=rdimon.specs", "-T",
            str(folder / "cortex_m.ld"), str(folder / "cortex_m_startup.c"), *units, "-o", str(folder / "program.elf"),
            "-lm",
        ])  # fmt: skip
        done = run_command([
            EMULATOR, "-M", processor.board, "-display", "none", "-monitor", "none", "-serial", "none",
            "-semihosting-config", "enable=on,target=native", "-kernel", str(folder / "program.elf"),
        ])  # fmt: skip
        code, stack = measure_sizes(command, shutil.which(SIZE), sources, folder)
        return BuiltProgram(done.stdout, done.stderr, code, stack)
