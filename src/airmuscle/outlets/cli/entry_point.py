"""Entry point of the command `airmuscle`, and deferred handling of SIGINT (Ctrl-C), so that no interruption is lost.

Interruptions are handled before anything else is imported."""

import contextlib
import functools
import importlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables of the threads of linear algebra. By default a command uses one: its matrices are small, and
threads that wait for each other take the cores from its processes and from other programs."""


def main() -> None:
    """Run the command line and exit with its exit code; an interruption, also of an import, exits with 130."""
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")
    try:
        with deferred_sigint():
            app = importlib.import_module(".commands", __package__).app
            check_interrupted()
            app(prog_name="airmuscle")
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None


INTERRUPTED = 130
"""Exit code of an interrupted command: 128 + SIGINT."""

_received = threading.Event()


@contextlib.contextmanager
def deferred_sigint() -> Iterator[None]:
    """Within the block SIGINT raises KeyboardInterrupt; if that exception is lost, the end of the block raises it.

    Python discards exceptions raised in a destructor or in the callback of a weak reference, and imports run many of
    these; an extension module whose import is interrupted raises ImportError instead. Blocks may be nested. Outside
    the main thread, and where SIGINT is ignored (a background job of a shell) or has another handler, the block
    changes nothing.
    """
    handler = signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    if handler not in (signal.default_int_handler, _receive):
        yield
        return
    outermost, report_unraisable = handler is not _receive, sys.unraisablehook
    if outermost:
        _received.clear()
        sys.unraisablehook = functools.partial(_report_unraisable, report_unraisable)
        signal.signal(signal.SIGINT, _receive)
    try:
        yield
        check_interrupted()
    except Exception:
        check_interrupted()
        raise
    finally:
        if outermost:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.unraisablehook = report_unraisable
            _received.clear()


def check_interrupted() -> None:
    """Raise KeyboardInterrupt if SIGINT was received within a block; long computations call this repeatedly."""
    if _received.is_set():
        raise KeyboardInterrupt


def _report_unraisable(report: Callable[[Any], Any], discarded: Any) -> None:
    """Report an exception that Python discards, unless it is an interruption, which the end of the block raises."""
    if not issubclass(discarded.exc_type, KeyboardInterrupt):
        report(discarded)


def _receive(number: int, frame: Any) -> None:
    _received.set()
    signal.default_int_handler(number, frame)
