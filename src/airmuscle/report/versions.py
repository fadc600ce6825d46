"""Software versions of a report, for reproducibility."""

from __future__ import annotations

import functools
import platform
from importlib import metadata

_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "casadi", "matplotlib")


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of airmuscle, Python and the numerical packages; `not installed` for a missing one."""
    return {
        "airmuscle": _version("airmuscle"),
        "Python": platform.python_version(),
        **{package: _version(package) for package in _PACKAGES},
        "machine": f"{platform.system()} {platform.machine()}",
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"
