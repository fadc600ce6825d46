"""Optional packages that read laboratory formats (extra `lab`), and a separate process for readers
in native code.
"""

import contextlib
import importlib
import importlib.util
import math
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from ....core import AirmuscleError, FileError, ParameterError, abridged, install_command
from ....engine.processes import Worker, WorkerError
from .file_kind import check_regular_file


def is_installed(name: str) -> bool:
    """Whether a package is installed; it is not imported."""
    try:
        return importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):  # of a part of a package that is not installed
        return False


def import_lab_package(name: str, path: Path) -> Any:
    """Import a package by its name. Raises FileError with the install command if it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise _missing_package(name, path) from None


def _missing_package(name: str, path: Path) -> FileError:
    extra = "ros" if name.startswith("rosbags") else "lab"
    return FileError(
        f"{path.name}: reading {path.suffix} files needs the package {name}. Install it:"
        f" {install_command(extra)}"
    )


@contextlib.contextmanager
def reading(path: Path, format_name: str) -> Iterator[None]:
    """Raise FileError, which names the file, in place of any exception of a package in this
    context.
    """
    check_regular_file(path)
    try:
        yield
    except (AirmuscleError, MemoryError):  # the latter is named by `too_large`
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
FURTHER = 25e6
"""Limits of time and processor time [s] of a file, and of every further 25 MB (chosen: as text with
a column of words they take 5 s, in other formats 1 s).
"""
MEMORY_SETTING = "AIRMUSCLE_READER_MEMORY"
"""Environment variable with the limit of the memory of a reader, such as `8 GB`."""
MEMORY_LIMIT = 2e9
MEMORY_FACTOR = 10.0
"""Limit of the memory [bytes] that a reader takes beside its packages, or this multiple of the size
of the file if that is more (chosen: twice what a column takes in text, numbers and the answer).
"""
_SIZE = re.compile(r"\s*(?P<number>\d+(?:\.\d+)?)\s*(?P<unit>[MG])B\s*")
_BYTES = {"M": 1e6, "G": 1e9}
_worker = Worker(quiet=True)
stop = _worker.stop
"""Ends the present process; the next request starts another one."""
_lock = threading.Lock()


def memory_limit(size: int) -> float:
    """The limit of the memory [bytes] of the reader of a file of this size [bytes]. Raises
    ParameterError for a setting that states none.
    """
    text = os.environ.get(MEMORY_SETTING, "")
    match = _SIZE.fullmatch(text)
    if text and not match:
        raise ParameterError(
            f"the environment variable {MEMORY_SETTING} is {abridged(text)}; it must be a size in"
            " MB or GB, such as '4 GB'."
        )
    limit = float(match["number"]) * _BYTES[match["unit"]] if match else MEMORY_LIMIT
    return max(limit, MEMORY_FACTOR * size)


def too_large(path: Path, limit: float) -> FileError:
    """The error of a file whose reader needs more memory than the limit [bytes]."""
    return FileError(
        f"{path.name}: its reader needs more than {limit / 1e9:.3g} GB of memory, so the file is"
        " damaged or unusually large. If you trust it, state a higher limit in the environment"
        f" variable {MEMORY_SETTING}, such as '{math.ceil(2.0 * limit / 1e9)} GB', or export fewer"
        " rows."
    )


def check_installed(package: str, path: Path) -> None:
    """Raise FileError with the install command if a package is not installed."""
    if not is_installed(package):
        raise _missing_package(package, path)


def call_in_separate_process(
    module: str,
    function: str,
    path: Path,
    *arguments: Any,
    progress: Callable[[str, float], None] | None = None,
) -> Any:
    """Return `function(path, *arguments)` of a module, evaluated in the separate process; with
    `progress`, the function receives one as last argument. An exception of the function is raised
    here. Raises FileError if the process ends or exceeds its limits of time and memory.
    """
    path = Path(path).absolute()
    size = path.stat().st_size
    longer = 1.0 + size / FURTHER
    memory = memory_limit(size)
    limits = Limits(CPU_LIMIT * longer, memory)
    try:
        with _lock:
            return _worker.call(
                call_function,
                (limits, module, function, path, *arguments),
                TIME_LIMIT * longer,
                None if progress is None else _of_files(progress),
            )
    except WorkerError as error:
        cause = (
            f"its reading takes more than {TIME_LIMIT * longer:.0f} s"
            if error.late
            else "its reader ended without a result, because the data are damaged, or need more"
            f" than {limits.seconds:.0f} s of a processor or {memory / 1e9:.3g} GB of memory"
        )
    except AirmuscleError:
        raise
    except MemoryError:
        raise too_large(path, memory) from None
    except Exception as error:  # in what a package returned of a damaged file
        cause = " ".join(f"{type(error).__name__}: {error}".split())[:120]
    raise FileError(
        f"{path.name}: the file is damaged or too large ({cause}). Copy it again from its source,"
        " or export it as text."
    )


def _of_files(progress: Callable[[str, float], None]) -> Callable[..., None]:
    """The report to a worker of the fractions of files that it has read, without its start."""

    def report(*told: Any) -> None:
        if isinstance(told[0], str):
            progress(*told)

    return report


class Limits(NamedTuple):
    """Processor time [s] and memory [bytes] that the reader of a file may take."""

    seconds: float
    memory: float


def named_function(module: str, function: str) -> Callable[..., Any]:
    """The function of a module, which is imported."""
    named: Callable[..., Any] = getattr(importlib.import_module(module), function)
    return named


def call_function(limits: Limits, module: str, function: str, path: Path, *arguments: Any) -> Any:
    """The result of a function of a module, which is imported only in the separate process, within
    its limits.
    """
    # the pool of memory that Arrow has by default reserves a gigabyte that it does not use
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    reader = named_function(module, function)
    if resource is not None:
        _limit(resource.RLIMIT_CPU, time.process_time() + limits.seconds)
        _limit(resource.RLIMIT_AS, _address_space() + limits.memory)
    return reader(path, *arguments)


def _address_space() -> int:
    """The address space [bytes] of this process, which its packages reserve before they read."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except (OSError, ValueError):  # another system than Linux
        return 0
    return pages * resource.getpagesize()


def _limit(kind: int, value: float) -> None:
    hard = resource.getrlimit(kind)[1]
    resource.setrlimit(
        kind,
        (int(value) + 1 if hard == resource.RLIM_INFINITY else min(int(value) + 1, hard), hard),
    )
