"""Output folders that are kept from other processes, and errors of files."""

import contextlib
import errno
import os
from collections.abc import Collection, Iterator
from pathlib import Path

from .errors import FileError, FolderInUseError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

FULL = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of the errors of a full disk and of an exhausted quota."""
REMEDY_WHERE_FULL = "Free space there, or specify another folder."
_held: dict[Path, tuple[int, list[Path]]] | None = None
"""Descriptors of the folders that are kept from other processes, and the folders that were created
for it.
"""


@contextlib.contextmanager
def exclusive_folders() -> Iterator[None]:
    """Keep other processes from the folders that `check_writable` checks in the block, so that no
    files are mixed.

    The lock is that of the operating system, which also ends with the process; Windows has none for
    folders.
    """
    global _held  # noqa: PLW0603
    outer = _held
    _held = {}
    try:
        yield
    finally:
        released = _held
        _held = outer
        for descriptor, created in released.values():
            os.close(descriptor)
            remove_empty_folders(created)


def hold(target: Path, created: list[Path]) -> bool:
    """Lock a folder until the end of the block; `created` are removed then, where they are empty.
    False where nothing is locked, and the caller removes them.
    """
    if _held is None:
        return False
    if fcntl is None or target.resolve() in _held:
        return True
    with raise_file_errors(target):
        target.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(target, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise FolderInUseError(
            f"{target}: another command is writing to this folder. Wait until it ends, or specify"
            " another folder."
        ) from None
    except OSError:  # a file system without locks
        os.close(descriptor)
        return True
    _held[target.resolve()] = descriptor, created
    return True


@contextlib.contextmanager
def raise_file_errors(target: Path, numbers: Collection[int] = ()) -> Iterator[None]:
    """Raise FileError for an error of the operating system; of these numbers alone, if some are
    given.
    """
    try:
        yield
    except OSError as error:
        if numbers and error.errno not in numbers:
            raise
        at = f" ({error.filename})" if error.filename and Path(error.filename) != target else ""
        remedy = (
            REMEDY_WHERE_FULL if error.errno in FULL else "Specify a folder with write permission."
        )
        raise FileError(
            f"{target}: cannot be written to: {error.strerror or error}{at}. {remedy}"
        ) from error


def remove_empty_folders(folders: list[Path]) -> None:
    """Remove those of the folders that are empty."""
    for folder in folders:
        with contextlib.suppress(OSError):  # not created, or no longer empty
            folder.rmdir()
