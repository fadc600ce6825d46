"""Separate process for readers in native code, which a damaged file may end with a segmentation fault.

The process is started for the first file and serves all others, so that the packages are loaded once. It ends with the
calling process, whose end closes the pipe. A new one is started after it has ended or has been stopped.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import importlib
import os
import pickle
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO, Any

from ...core.errors import FileError
from .file_kind import check_regular_file
from .optional_dependency import check_lab_package

TIME_LIMIT = 60.0
"""Time limit [s] of a file, and of every further 100 MB (chosen: 20 MB take less than one second)."""
_START = f"import sys; sys.path[:] = sys.argv[1:]; from {__name__} import serve; serve()"
_lock = threading.Lock()


def read_in_separate_process(package: str, module: str, function: str, path: Path, *arguments: Any) -> Any:
    """Return what a reader in a module of this package reads, as `call_in_separate_process`, from a regular file.

    Raises FileError if the package that the reader needs is not installed, or if the file is not regular.
    """
    check_lab_package(package, path)
    check_regular_file(path)
    return call_in_separate_process(module, function, path, *arguments)


def call_in_separate_process(module: str, function: str, path: Path, *arguments: Any) -> Any:
    """Return `function(path, *arguments)` of a module of this package, evaluated in the separate process.

    An exception of the function is raised here. Raises FileError if the process ends or exceeds the time limit.
    """
    path = Path(path).absolute()
    with _lock:
        worker = _worker()
        limit = TIME_LIMIT * (1.0 + path.stat().st_size / 1e8)
        timer = threading.Timer(limit, worker.kill)
        timer.start()
        try:
            result, error = _ask(worker, (module, function, path, arguments))
        except (EOFError, OSError, pickle.UnpicklingError):
            late = timer.finished.is_set()
            stop()
            cause = f"its reading takes more than {limit:.0f} s" if late else "its reader ended without a result"
            raise FileError(
                f"{path.name}: the file is damaged ({cause}). Copy it again from its source, or export it as text."
            ) from None
        except BaseException:  # an interruption, after which the answer would be that to the next request
            stop()
            raise
        finally:
            timer.cancel()
    if error is not None:
        raise error
    return result


def serve() -> None:
    """Answer requests from the standard input until it is closed; what a package prints is discarded."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with contextlib.suppress(EOFError, KeyboardInterrupt, BrokenPipeError):
        while True:
            module, function, path, arguments = pickle.load(requests)
            _answer(module, function, path, arguments, answers)


def _ask(worker: subprocess.Popen[bytes], request: tuple[Any, ...]) -> Any:
    if worker.stdin is None or worker.stdout is None:
        raise EOFError
    pickle.dump(request, worker.stdin)
    worker.stdin.flush()
    return pickle.load(worker.stdout)


def _answer(module: str, function: str, path: Path, arguments: tuple[Any, ...], answers: IO[bytes]) -> None:
    try:
        result = getattr(importlib.import_module(module), function)(path, *arguments), None
        content = pickle.dumps(result, protocol=pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # raised by the caller
        content = pickle.dumps((None, error))
    answers.write(content)
    answers.flush()


@functools.cache
def _worker() -> subprocess.Popen[bytes]:
    worker = subprocess.Popen(
        [sys.executable, "-c", _START, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    atexit.register(_end, worker)
    return worker


def stop() -> None:
    """End the present process; the next request starts another one."""
    _end(_worker())
    _worker.cache_clear()


def _end(worker: subprocess.Popen[bytes]) -> None:
    worker.kill()
    worker.wait()
    for pipe in (worker.stdin, worker.stdout):
        with contextlib.suppress(OSError):
            if pipe is not None:
                pipe.close()
