"""The one line that tells why the first run on a machine takes longer."""

from __future__ import annotations

import pathlib
import sys
from typing import Any

_announced: set[Any] = set()


def announce_compilation(kernel: Any) -> None:
    """Say on stderr that numba is about to compile a kernel, if this machine has not compiled it before."""
    if kernel in _announced:
        return
    _announced.add(kernel)
    if kernel.signatures:
        return
    cache = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    index = getattr(cache, "_index_path", None)
    if index is None or not pathlib.Path(index).exists():
        announce(kernel.__name__)


def announce(name: str) -> None:
    """Say on stderr that a kernel is about to be compiled."""
    print(f"compiling {name}, once on this machine (some seconds) ...", file=sys.stderr, flush=True)
