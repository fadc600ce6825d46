"""Deferred handling of SIGINT (Ctrl-C), so that no interruption of the command `airmuscle` is
lost, and an orderly end by SIGTERM (kill), which leaves no unfinished file.
"""

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from typing import Any

INTERRUPTED = 130
"""Exit code of an interrupted command: 128 + SIGINT."""

TERMINATED = 143
"""Exit code of a command that was ended by SIGTERM: 128 + SIGTERM."""

_received = threading.Event()


def end_on_sigterm() -> None:
    """From now on SIGTERM, unless it is ignored or handled already, leaves all blocks of the main
    thread, which remove their temporary files, and ends the process.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _end)


def _end(number: int, frame: Any) -> None:
    raise SystemExit(TERMINATED)


@contextlib.contextmanager
def deferred_sigint() -> Iterator[None]:
    """Within the block SIGINT raises KeyboardInterrupt; if that exception is lost, the end of the
    block raises it.

    Python discards exceptions raised in a destructor or in the callback of a weak reference, and
    imports run many of these; an extension module whose import is interrupted raises ImportError
    instead. Blocks may be nested. Outside the main thread, and where SIGINT is ignored (a
    background job of a shell) or has another handler, the block changes nothing.
    """
    handler = (
        signal.getsignal(signal.SIGINT)
        if threading.current_thread() is threading.main_thread()
        else None
    )
    if handler not in (signal.default_int_handler, _receive):
        yield
        return
    outermost = handler is not _receive
    report_unraisable = sys.unraisablehook

    def report_others(
        discarded: Any,
    ) -> None:  # but no interruption, which the end of the block raises
        if not issubclass(discarded.exc_type, KeyboardInterrupt):
            report_unraisable(discarded)

    if outermost:
        _received.clear()
        sys.unraisablehook = report_others
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
    """Raise KeyboardInterrupt if SIGINT was received within a block; long computations call this
    repeatedly.
    """
    if _received.is_set():
        raise KeyboardInterrupt


def _receive(number: int, frame: Any) -> None:
    _received.set()
    signal.default_int_handler(number, frame)
