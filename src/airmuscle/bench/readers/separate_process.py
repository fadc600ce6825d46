"""Separate process for readers in native code, which a damaged file may end with a segmentation fault.

The process is started for the first file and serves all others, so that the packages are loaded once.
"""

from __future__ import annotations

import importlib
import threading
from pathlib import Path
from typing import Any

from ...core.errors import FileError
from ...engine.processes import Worker, WorkerError
from .file_kind import check_regular_file
from .optional_dependency import check_lab_package

TIME_LIMIT = 60.0
"""Time limit [s] of a file, and of every further 100 MB (chosen: 20 MB take less than one second)."""
_worker = Worker(quiet=True)
_lock = threading.Lock()


def read_in_separate_process(package: str, module: str, function: str, path: Path, *arguments: Any) -> Any:
    """Return what a reader in a module of this package reads, as `call_in_separate_process`, from a regular file.

    Raises FileError if the package that the reader needs is not installed, or if the file is not regular.
    """
    check_lab_package(package, path)
    check_regular_file(path)
    return call_in_separate_process(module, function, path, *arguments)


def call_in_separate_process(module: str, function: str, path: Path, *arguments: Any) -> Any:
    """Return `function(path, *arguments)` of a module, evaluated in the separate process.

    An exception of the function is raised here. Raises FileError if the process ends or exceeds the time limit.
    """
    path = Path(path).absolute()
    limit = TIME_LIMIT * (1.0 + path.stat().st_size / 1e8)
    try:
        with _lock:
            return _worker.call(call_function, (module, function, path, *arguments), limit)
    except WorkerError as error:
        cause = f"its reading takes more than {limit:.0f} s" if error.late else "its reader ended without a result"
        raise FileError(
            f"{path.name}: the file is damaged ({cause}). Copy it again from its source, or export it as text."
        ) from None


def call_function(module: str, function: str, *arguments: Any) -> Any:
    """The result of a function of a module, which is imported only in the separate process."""
    return getattr(importlib.import_module(module), function)(*arguments)


def stop() -> None:
    """End the present process; the next request starts another one."""
    _worker.stop()
