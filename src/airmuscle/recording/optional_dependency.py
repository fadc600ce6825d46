"""The packages that read the file formats of laboratories; they come with the extra `lab`."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ..core.errors import AirmuscleError, FileError

Read = TypeVar("Read")


def import_lab_package(name: str, path: Path) -> Any:
    """The package by its name. Raises FileError with what to install where it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise FileError(
            f"{path.name}: reading {path.suffix} files needs the package {name}. Install it: pip install airmuscle[lab]"
        ) from None


def run_reader(path: Path, what: str, read: Callable[[], Read]) -> Read:
    """What `read` makes of a file; whatever these packages raise becomes one FileError that names the file."""
    if not path.is_file():
        raise FileError(f"{path}: cannot be read (there is no such file). Check the name and the folder.")
    try:
        return read()
    except AirmuscleError:
        raise
    except Exception as reason:  # each package raises kinds of its own on a damaged file
        said = " ".join(str(reason).split())[:120] or type(reason).__name__
        raise FileError(
            f"{path.name}: cannot be read as {what} ({said}). Is the file complete, and its ending right?"
        ) from None
