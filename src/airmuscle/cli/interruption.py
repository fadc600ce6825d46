"""Ctrl-C that is never forgotten."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from typing import Any

_pressed = threading.Event()


@contextlib.contextmanager
def deferred_sigint() -> Iterator[None]:
    """Within the block Ctrl-C raises KeyboardInterrupt as ever; if that is lost, `look` and the block's end raise it.

    Python throws away what is raised in a destructor or in the callback of a weak reference, of which imports have
    many, and a compiled module whose import is interrupted fails as an ImportError. Where Ctrl-C is ignored, as by a
    job that a shell runs in the background, or somebody else listens to it, it stays so.
    """
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    _pressed.clear()
    signal.signal(signal.SIGINT, _hear)
    try:
        yield
        check_interrupted()
    except Exception:
        check_interrupted()
        raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _pressed.clear()


def check_interrupted() -> None:
    """Raise KeyboardInterrupt if Ctrl-C was pressed in a block; long work asks this now and then."""
    if _pressed.is_set():
        raise KeyboardInterrupt


def _hear(number: int, frame: Any) -> None:
    _pressed.set()
    signal.default_int_handler(number, frame)
