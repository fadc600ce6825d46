"""Platforms of shared libraries: this machine by its own compiler, and others by zig as a cross compiler."""

from __future__ import annotations

import dataclasses
import importlib.util
import platform
import sys
from collections.abc import Mapping, Sequence

from ...core.errors import ParameterError, suggestion
from .compiler import compile_with, find_compiler

PACKAGE = "ziglang"


@dataclasses.dataclass(frozen=True)
class Platform:
    """A platform of FMUs: folder of its binaries in FMI 2 and 3, and suffix of its shared libraries.

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
        """The shared library `name` of the files `units` among `sources`.

        Raises ParameterError where the compiler is missing, FileError where it fails.
        """
        if not self.target:
            return compile_with([find_compiler()], sources, units, name + self.suffix)
        command = [*find_cross_compiler(), "-target", self.target]
        return compile_with(command, sources, units, name + self.suffix)


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
    if name not in PLATFORMS:
        raise ParameterError(
            f"there is no platform '{name}'; there are {', '.join(PLATFORMS)}.{suggestion(name, PLATFORMS)}"
        )
    return PLATFORMS[name]


def find_cross_compiler() -> list[str]:
    """The command of the cross compiler. Raises ParameterError, with the command that installs it."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise ParameterError(
            f"binaries for chosen platforms need the package {PACKAGE}, a cross compiler. Install it: pip install "
            "airmuscle[fmu]; or leave the platforms out: the binary is then that of this machine."
        )
    return [sys.executable, "-P", "-m", PACKAGE, "cc"]


def this_platform() -> Platform:
    """The platform of this machine."""
    system = {"win32": "windows", "darwin": "darwin"}.get(sys.platform, "linux")
    suffix = {"windows": ".dll", "darwin": ".dylib", "linux": ".so"}[system]
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    of_fmi_2 = {"windows": "win64", "darwin": "darwin64", "linux": "linux64"}[system]
    folder = f"{machine}-{system}"
    return Platform(of_fmi_2 if machine == "x86_64" or system == "darwin" else folder, folder, suffix)
