"""C compilers: exported programs built and run on this machine, on other platforms, and on a
microcontroller in the emulator QEMU."""

import dataclasses
import importlib.util
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...core import FileError, ParameterError, check_known, install_command, temporary_folder
from .identifiers import template

COMPILERS = ("gcc", "clang", "cc")
OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden", "-s")
"""No contraction of products and sums: the numbers are those of the library on every processor."""
TIME_LIMIT = 600.0
"""Time [s] after which a compiler or a program is stopped (chosen)."""


def compile_library(
    sources: Mapping[str, bytes],
    units: Sequence[str],
    name: str,
    more: Sequence[str] = (),
    command: Sequence[str] | None = None,
) -> bytes:
    """The shared library `name` of the files `units` among `sources`, compiled in a fresh folder by
    a compiler with its first and `more` arguments, by default that of this machine.

    Raises ParameterError where there is no compiler, FileError where it fails.
    """
    with temporary_folder() as folder:
        for file, text in sources.items():
            (folder / file).write_bytes(text)
        run_command(
            [*(command or [find_compiler()]), *OPTIONS, *units, "-o", name, *more, "-lm"], folder
        )
        return (folder / name).read_bytes()


def find_compiler(remedy: str = "; install the package gcc or clang") -> str:
    """The path of a C compiler. Raises ParameterError, whose text ends with `remedy`."""
    for name in COMPILERS:
        path = shutil.which(name)
        if path:
            return path
    raise ParameterError(f"no C compiler ({', '.join(COMPILERS)}) was found{remedy}")


def run_command(
    command: Sequence[str], folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a compiler or a program in a folder. Raises FileError with its message if it fails or
    takes too long.
    """
    name = (
        command[3] if list(command[1:3]) == ["-P", "-m"] else Path(command[0]).name
    )  # a program that is a package
    try:
        done = subprocess.run(
            command, cwd=folder, check=False, capture_output=True, text=True, timeout=TIME_LIMIT
        )
    except subprocess.TimeoutExpired:
        raise FileError(f"{name} was stopped after {TIME_LIMIT:g} s.") from None
    if done.returncode:
        reason = " ".join((done.stderr or done.stdout).split())[:300]
        raise FileError(f"{name} failed with exit code {done.returncode}: {reason}")
    return done


@dataclasses.dataclass(frozen=True)
class BuiltProgram:
    """Standard output and error of an exported program, and the bytes of its sources without
    `main.c`, compiled small.

    code_size   [bytes] machine code and constants; None where the program `size` is missing
    stack_size  [bytes] of all functions together, without those of the C library; None where it is
                not known
    """

    output: str
    messages: str
    code_size: int | None
    stack_size: int | None = None


def measure_sizes(
    command: Sequence[str], size: str | None, sources: Sequence[Path], folder: Path
) -> tuple[int | None, int | None]:
    """The bytes of machine code and constants, and of the stack, of sources without `main.c`,
    optimised for size by a compiler with its options; `size` is the program of this name."""
    units = [p for p in sources if p.suffix == ".c" and p.name != "main.c"]
    if not units:
        return None, None
    code = 0
    stack = 0
    options = ["-std=c99", "-Os", "-ffp-contract=off", "-fstack-usage", "-c"]
    for unit in units:
        target = folder / f"{unit.stem}.o"
        run_command([*command, *options, str(unit), "-o", str(target)])
        numbers = (
            re.search(r"^\s*(\d+)", run_command([size, str(target)]).stdout, re.MULTILINE)
            if size
            else None
        )
        code += int(numbers.group(1)) if numbers else 0
        usage = target.with_suffix(".su")
        stack += sum(
            map(int, re.findall(r"\t(\d+)\t", usage.read_text() if usage.exists() else ""))
        )
    return code or None, stack or None


COMPILER = "arm-none-eabi-gcc"
SIZE = "arm-none-eabi-size"
EMULATOR = "qemu-system-arm"
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
"""Processors by name: Cortex-M4 with a unit for single precision, Cortex-M7 with one for double
precision.
"""


def build_and_run(sources: Sequence[Path], processor: Processor | None = None) -> BuiltProgram:
    """Compile exported C sources in a temporary folder and run the program, for a processor in the
    emulator QEMU; the folder of the sources is unchanged.

    Raises ParameterError where a compiler or the emulator is missing, and FileError where one of
    them or the program fails.
    """
    units = [str(p) for p in sources if p.suffix == ".c"]
    place = sources[0].parent
    if processor is None:
        command = [
            find_compiler(
                f". The sources are in {place}; install gcc or clang, or compile them elsewhere: cc"
                f" -O2 {' '.join(Path(p).name for p in units)} -lm -o program. JavaScript and"
                " Octave need no compiler."
            )
        ]
    else:
        for name in (tool for tool in (COMPILER, EMULATOR) if shutil.which(tool) is None):
            raise ParameterError(
                f"{name} was not found. The sources are in {place}; to compile and run them for a"
                f" microcontroller install the packages {PACKAGES} (names of Debian)."
            )
        command = [COMPILER, "-mthumb", "-mfloat-abi=hard", *processor.options]
    with temporary_folder() as folder:
        program = str(folder / "program")
        start = list[str]()
        run = list[str]()
        if processor is not None:
            startup = folder / "cortex_m_startup.c"
            script = folder / "cortex_m.ld"
            for file in (startup, script):
                file.write_text(template(file.name), encoding="utf-8")
            start = ["-nostartfiles", "--specs=rdimon.specs", "-T", str(script), str(startup)]
            run = [
                EMULATOR,
                "-M",
                processor.board,
                "-display",
                "none",
                "-monitor",
                "none",
                "-serial",
                "none",
                "-semihosting-config",
                "enable=on,target=native",
                "-kernel",
            ]
        run_command(
            [*command, "-std=c99", "-O2", "-ffp-contract=off", *start, *units, "-o", program, "-lm"]
        )
        done = run_command([*run, program])
        code, stack = measure_sizes(
            command, shutil.which(SIZE if processor else "size"), sources, folder
        )
        return BuiltProgram(done.stdout, done.stderr, code, stack if processor else None)


PACKAGE = "ziglang"


@dataclasses.dataclass(frozen=True)
class Platform:
    """A platform of FMUs: folder of its binaries in FMI 2 and 3, and suffix of its shared
    libraries.

    target  name of the platform for the cross compiler; empty: this machine, by its own compiler
    """

    folder_2: str
    folder_3: str
    suffix: str
    target: str = ""

    def folder(self, fmi: int) -> str:
        """The folder of the binaries in a version of FMI."""
        return self.folder_2 if fmi == 2 else self.folder_3

    def compile(self, sources: Mapping[str, bytes], units: Sequence[str], name: str) -> bytes:
        """The shared library `name` of the files `units` among `sources`. Raises ParameterError
        where the compiler is missing, FileError where it fails."""
        command = [*find_cross_compiler(), "-target", self.target] if self.target else None
        return compile_library(sources, units, name + self.suffix, command=command)


PLATFORMS = {
    "linux64": Platform("linux64", "x86_64-linux", ".so", "x86_64-linux-gnu.2.17"),
    "linux-aarch64": Platform("aarch64-linux", "aarch64-linux", ".so", "aarch64-linux-gnu.2.17"),
    "win64": Platform("win64", "x86_64-windows", ".dll", "x86_64-windows-gnu"),
    "win-aarch64": Platform("aarch64-windows", "aarch64-windows", ".dll", "aarch64-windows-gnu"),
    "darwin64": Platform("darwin64", "x86_64-darwin", ".dylib", "x86_64-macos"),
    "darwin-aarch64": Platform("aarch64-darwin", "aarch64-darwin", ".dylib", "aarch64-macos"),
}
"""Platforms by name; those of Linux need glibc 2.17 or later."""


def find_platform(name: str) -> Platform:
    """The platform of a name. Raises ParameterError, with the nearest name."""
    check_known("there is no platform", name, PLATFORMS)
    return PLATFORMS[name]


def find_cross_compiler() -> list[str]:
    """The command of the cross compiler. Raises ParameterError, with the command that installs
    it.
    """
    if importlib.util.find_spec(PACKAGE) is None:
        raise ParameterError(
            f"binaries for chosen platforms need the package {PACKAGE}, a cross compiler. Install"
            f" it: {install_command('fmu')}; or leave the platforms out: the binary is then that"
            " of this machine."
        )
    return [sys.executable, "-P", "-m", PACKAGE, "cc"]


def this_platform() -> Platform:
    """The platform of this machine."""
    systems = {"win32": ("windows", ".dll", "win64"), "darwin": ("darwin", ".dylib", "darwin64")}
    system, suffix, of_fmi_2 = systems.get(sys.platform, ("linux", ".so", "linux64"))
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    folder = f"{machine}-{system}"
    return Platform(
        of_fmi_2 if machine == "x86_64" or system == "darwin" else folder, folder, suffix
    )
