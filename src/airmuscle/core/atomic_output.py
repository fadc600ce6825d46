"""Atomic output of a single file: it is complete or unchanged, whatever happens while it is written."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator
from pathlib import Path

_MAX_NAME = 100
"""Number of characters of the name of a file that its temporary file has (chosen); file systems limit names to 255."""


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Yield the path of a temporary file next to `path`, which replaces it when the block ends without an exception.

    If the block raises, `path` is unchanged and the temporary file is removed. Its name is that of the process and the
    thread, so that several writers do not meet. Errors of the operating system are those of `open` and `os.replace`.
    """
    temporary = path.with_name(f".{path.name[:_MAX_NAME]}.{os.getpid()}-{threading.get_ident()}.part")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):  # renamed, or never created
            temporary.unlink()
