"""Optional packages that read laboratory file formats; the extra `lab` installs them."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ..core.errors import AirmuscleError, FileError

Result = TypeVar("Result")


def import_lab_package(name: str, path: Path) -> Any:
    """Import a package by its name. Raises FileError with the install command if it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise FileError(
            f"{path.name}: reading {path.suffix} files needs the package {name}. Install it: pip install airmuscle[lab]"
        ) from None


def run_reader(path: Path, format_name: str, read: Callable[[], Result]) -> Result:
    """Call `read` and return its result; any exception of the package becomes a FileError that names the file."""
    if not path.is_file():
        raise FileError(f"{path}: cannot be read (there is no such file). Check the name and the folder.")
    try:
        return read()
    except AirmuscleError:
        raise
    except Exception as reason:  # each package raises its own exceptions for a damaged file
        detail = " ".join(str(reason).split())[:120] or type(reason).__name__
        raise FileError(
            f"{path.name}: cannot be read as {format_name} ({detail}). Check that the file is complete and that its "
            "extension matches its format."
        ) from None
