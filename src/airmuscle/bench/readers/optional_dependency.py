"""Optional packages that read laboratory file formats; the extra `lab` installs them."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ...core.errors import AirmuscleError, FileError
from .file_kind import check_regular_file

Result = TypeVar("Result")


def is_installed(name: str) -> bool:
    """Whether a package is installed; it is not imported."""
    return importlib.util.find_spec(name) is not None


def check_lab_package(name: str, path: Path) -> None:
    """Raise FileError with the install command if a package is missing; the package is not imported."""
    if not is_installed(name):
        raise _missing_package(name, path)


def import_lab_package(name: str, path: Path) -> Any:
    """Import a package by its name. Raises FileError with the install command if it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise _missing_package(name, path) from None


def _missing_package(name: str, path: Path) -> FileError:
    extra = "ros" if name.startswith("rosbags") else "lab"
    return FileError(
        f"{path.name}: reading {path.suffix} files needs the package {name}. Install it: pip install airmuscle[{extra}]"
    )


def run_reader(path: Path, format_name: str, read: Callable[[], Result]) -> Result:
    """Call `read` and return its result; any exception of the package becomes a FileError that names the file."""
    check_regular_file(path)
    try:
        return read()
    except AirmuscleError:
        raise
    except Exception as reason:  # each package raises its own exceptions for a damaged file
        detail = " ".join(str(reason).split())[:120] or type(reason).__name__
        raise FileError(
            f"{path.name}: cannot be read as {format_name} ({detail}); it is damaged or of another format. "
            "Check that the file is complete and that its extension matches its format."
        ) from None
