"""Optional packages that read laboratory formats (extra `lab`), and a separate process for readers
in native code.
"""

import contextlib
import functools
import importlib
import importlib.util
import inspect
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from ...core import AirmuscleError, FileError
from ...engine.processes import Worker, WorkerError
from .file_kind import check_regular_file

Result = TypeVar("Result")
Given = ParamSpec("Given")


def is_installed(name: str) -> bool:
    """Whether a package is installed; it is not imported."""
    return importlib.util.find_spec(name) is not None


def import_lab_package(name: str, path: Path) -> Any:
    """Import a package by its name. Raises FileError with the install command if it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise _missing_package(name, path) from None


def _missing_package(name: str, path: Path) -> FileError:
    extra = "ros" if name.startswith("rosbags") else "lab"
    return FileError(
        f"{path.name}: reading {path.suffix} files needs the package {name}. Install it: pip"
        f" install airmuscle[{extra}]"
    )


@contextlib.contextmanager
def reading(path: Path, format_name: str) -> Iterator[None]:
    """Raise FileError, which names the file, in place of any exception of a package in this
    context.
    """
    check_regular_file(path)
    try:
        yield
    except AirmuscleError:
        raise
    except Exception as reason:  # each package raises its own exceptions for a damaged file
        detail = " ".join(str(reason).split())[:120] or type(reason).__name__
        raise FileError(
            f"{path.name}: cannot be read as {format_name} ({detail}); it is damaged or of another"
            " format. Check that the file is complete and that its extension matches its format."
        ) from None


try:
    import resource
except ImportError:  # Windows, where the time is limited alone
    resource = None  # type: ignore[assignment]

TIME_LIMIT = 60.0
CPU_LIMIT = 15.0
"""Limits of time and processor time [s] of a file, and of every further 100 MB (chosen: 20 MB take
less than 1 s).
"""
MEMORY_LIMIT = 6e9
MEMORY_FACTOR = 20.0
"""Limit of the memory [bytes], with this multiple of the size of the file (chosen)."""
_worker = Worker(quiet=True)
stop = _worker.stop
"""Ends the present process; the next request starts another one."""
_lock = threading.Lock()


def in_separate_process(
    package: str,
) -> Callable[[Callable[Given, Result]], Callable[Given, Result]]:
    """A decorator of a reader in native code, which the separate process evaluates, from a regular
    file. It raises FileError if the package that the reader needs is not installed, or if the file
    is not regular.
    """

    def decorated(read: Callable[Given, Result]) -> Callable[Given, Result]:
        @functools.wraps(read)
        def call(*arguments: Given.args, **named: Given.kwargs) -> Result:
            given = inspect.signature(read).bind(*arguments, **named)
            given.apply_defaults()
            path, *others = given.args
            if not is_installed(package):
                raise _missing_package(package, path)
            check_regular_file(path)
            found: Result = call_in_separate_process(read.__module__, read.__name__, path, *others)
            return found

        return call

    return decorated


def call_in_separate_process(module: str, function: str, path: Path, *arguments: Any) -> Any:
    """Return `function(path, *arguments)` of a module, evaluated in the separate process. An
    exception of the function is raised here. Raises FileError if the process ends or exceeds the
    time limit."""
    path = Path(path).absolute()
    limit, seconds = (each * (1.0 + path.stat().st_size / 1e8) for each in (TIME_LIMIT, CPU_LIMIT))
    try:
        with _lock:
            return _worker.call(call_function, (seconds, module, function, path, *arguments), limit)
    except WorkerError as error:
        cause = (
            f"its reading takes more than {limit:.0f} s"
            if error.late
            else "its reader ended without a result"
        )
    except AirmuscleError:
        raise
    except Exception as error:  # in what a package returned of a damaged file
        cause = " ".join(f"{type(error).__name__}: {error}".split())[:120]
    raise FileError(
        f"{path.name}: the file is damaged or too large ({cause}). Copy it again from its source,"
        " or export it as text."
    )


def call_function(seconds: float, module: str, function: str, path: Path, *arguments: Any) -> Any:
    """The result of a function of a module, which is imported only in the separate process, within
    its limits. `seconds` of the processor limit the time."""
    if resource is not None:
        size = path.stat().st_size
        _limit(resource.RLIMIT_CPU, time.process_time() + seconds)
        _limit(resource.RLIMIT_AS, MEMORY_LIMIT + MEMORY_FACTOR * size)
    reader = inspect.unwrap(getattr(importlib.import_module(module), function))
    return reader(path, *arguments)


def _limit(kind: int, value: float) -> None:
    hard = resource.getrlimit(kind)[1]
    resource.setrlimit(
        kind,
        (int(value) + 1 if hard == resource.RLIM_INFINITY else min(int(value) + 1, hard), hard),
    )
