"""Cache folder: a private folder of the user for machine code and other results that are computed once.

The folder is `AIRMUSCLE_CACHE_DIR`, or else `airmuscle/kernels` in the user's cache folder. It must belong to the user,
and nobody else may write to it, because what is in it is executed; otherwise it is not used.
"""

from __future__ import annotations

import functools
import os
import pathlib
import stat
import sys
import warnings

from .errors import AirmuscleWarning

_POSIX = hasattr(os, "getuid")


def cache_folder() -> pathlib.Path | None:
    """The folder, created if it is missing; None, with one warning, if no folder is private."""
    try:
        folder = _chosen_folder()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        state = folder.stat()
    except (OSError, RuntimeError) as error:  # RuntimeError: the user has no home folder
        warn_not_stored(f"there is no cache folder ({error})")
        return None
    if _POSIX and (state.st_uid != os.getuid() or state.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        warn_not_stored(f"other users may write to {folder}")
        return None
    return folder


def _chosen_folder() -> pathlib.Path:
    named = os.environ.get("AIRMUSCLE_CACHE_DIR")
    if named:
        return pathlib.Path(named)
    defaults = {"win32": os.environ.get("LOCALAPPDATA"), "darwin": "~/Library/Caches"}
    root = defaults.get(sys.platform) or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return pathlib.Path(root).expanduser() / "airmuscle" / "kernels"


def read_private(path: pathlib.Path) -> bytes | None:
    """The contents of a regular file that belongs to the user and that nobody else may write to."""
    try:
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)), "rb") as file:
            state = os.fstat(file.fileno())
            private = not _POSIX or (state.st_uid == os.getuid() and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH))
            return file.read() if private and stat.S_ISREG(state.st_mode) else None
    except OSError:
        return None


@functools.cache
def warn_not_stored(reason: str) -> None:
    """Warn that compiled kernels are not stored."""
    warnings.warn(
        f"compiled kernels are not stored: {reason}. Every process compiles them anew, which takes some seconds. "
        "Name a private folder in the environment variable AIRMUSCLE_CACHE_DIR.",
        AirmuscleWarning,
        stacklevel=2,
    )
