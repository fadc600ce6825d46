"""Atomic output: a file, or the files of a folder, appear completely or not at all."""

import contextlib
import errno
import glob
import os
import shutil
import socket
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

from .folder_locks import FULL, hold, raise_file_errors, remove_empty_folders

_MAX_NAME = 100
"""Number of characters of the name of a file that its temporary file has (chosen); file systems
limit names to 255.
"""


_OF_PROCESS = f".of-{socket.gethostname().replace('/', '')}-"
_PART = ".part"
"""Parts of the name of a temporary file: the machine, because folders may be shared, and a process
follow the name of the file.
"""
_searched: set[Path] = set()
"""Folders in which this process has removed what killed ones have left."""


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Yield the path of a temporary file next to `path`, which replaces it when the block ends
    without an exception.

    If the block raises, `path` is unchanged and the temporary file is removed. Its name is that of
    the machine, the process and the thread, so that several writers do not meet. What killed
    processes of this machine have left in the folder is removed, once in a process. Errors of the
    operating system are those of `open` and `os.replace`.
    """
    if not path.name:
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.is_char_device() or path.is_block_device():  # which would be replaced by a file
        raise OSError(errno.EINVAL, "it is a device, not a file", str(path))
    _remove_abandoned_files(path.parent)
    temporary = path.with_name(
        f".{path.name[:_MAX_NAME]}{_OF_PROCESS}{os.getpid()}-{threading.get_ident()}{_PART}"
    )
    try:
        yield temporary
        temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):  # renamed, or never created
            temporary.unlink()


def _remove_abandoned_files(folder: Path) -> None:
    """Remove the temporary files of processes of this machine, and of this user, that were
    killed.
    """
    if folder in _searched:
        return
    _searched.add(folder)
    for file in folder.glob(f".*{glob.escape(_OF_PROCESS)}*{_PART}"):
        process = file.name.rpartition(_OF_PROCESS)[2].partition("-")[0]
        with contextlib.suppress(OSError):  # removed by another process
            if process.isdecimal() and _is_own(file) and not is_running(int(process)):
                file.unlink()


def _is_own(path: Path) -> bool:
    """Whether a path is no link, and of this user."""
    owned = not hasattr(os, "getuid") or path.lstat().st_uid == os.getuid()
    return owned and not path.is_symlink()


_UNFINISHED = f".unfinished-{socket.gethostname().replace('/', '')}-"
"""Beginning of the name of a temporary folder, with the machine, because folders may be shared; a
process follows.
"""
_TEMPORARY = f"airmuscle-{socket.gethostname().replace('/', '')}-"
"""The same for a folder in that of the system."""


@contextlib.contextmanager
def atomic_folder(folder: Path | str) -> Iterator[Path]:
    """Yield an empty temporary folder whose files are moved into `folder` when the block ends
    without an exception.

    If the block raises, or the files cannot be written, `folder` remains unchanged, or is not
    created. Files of the same name are replaced, other files are kept. What a killed process has
    left in `folder` is removed. Raises FileError.
    """
    target = Path(folder)
    with raise_file_errors(target):
        created = _missing_folders(target)
    try:
        with raise_file_errors(target):
            target.mkdir(parents=True, exist_ok=True)
            _remove_abandoned(target)
            staging = Path(tempfile.mkdtemp(prefix=f"{_UNFINISHED}{os.getpid()}-", dir=target))
        try:
            with raise_file_errors(target, FULL):
                yield staging
            with raise_file_errors(target):
                _move_files(staging, target)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    except BaseException:
        remove_empty_folders(created)
        raise


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield an empty folder for the block, in that of the system; what a killed process has left
    there is removed.
    """
    target = Path(tempfile.gettempdir())
    _remove_abandoned(target, _TEMPORARY)
    with tempfile.TemporaryDirectory(
        prefix=f"{_TEMPORARY}{os.getpid()}-", dir=target, ignore_cleanup_errors=True
    ) as name:
        yield Path(name)


def _remove_abandoned(target: Path, prefix: str = _UNFINISHED) -> None:
    """Remove the temporary folders of processes of this machine, and of this user, that were
    killed.
    """
    for folder in target.glob(f"{prefix}*"):
        process = folder.name.removeprefix(prefix).partition("-")[0]
        with contextlib.suppress(OSError):  # removed by another process
            if process.isdecimal() and _is_own(folder) and not is_running(int(process)):
                shutil.rmtree(folder, ignore_errors=True)


def is_running(process: int) -> bool:
    """Whether a process of this number exists; true where this cannot be determined."""
    if not hasattr(os, "getuid"):  # on Windows, os.kill would end the process
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # the process of another user
        return True
    return True


def check_writable(folder: Path | str, *, shared: bool = False) -> None:
    """Raise FileError before a long computation if `atomic_folder` cannot write to `folder`; leaves
    no files.

    Within `exclusive_folders`, no other process may check the same folder until the block ends,
    unless it is `shared`: it raises FolderInUseError. A shared folder stays, because another
    process may have begun to use it.
    """
    target = Path(folder)
    with raise_file_errors(target):
        created = _missing_folders(target)
    try:
        with atomic_folder(target):
            pass
        if not shared and hold(target, created):
            created = []
        created = [] if shared else created
    finally:
        remove_empty_folders(created)


def _missing_folders(folder: Path) -> list[Path]:
    """Return the folders that `mkdir(parents=True)` would create, innermost first."""
    return [path for path in (folder, *folder.parents) if not path.exists()]


def _move_files(staging: Path, target: Path) -> None:
    """Move all files into `target`; every folder is created before the first file is moved."""
    files = sorted(path for path in staging.rglob("*") if path.is_file())
    moves = [(path, target / path.relative_to(staging)) for path in files]
    for _, destination in moves:
        if destination.is_dir():
            raise IsADirectoryError(21, "a folder of this name exists", str(destination))
        if destination.parent.exists() and not destination.parent.is_dir():
            raise NotADirectoryError(20, "a file of this name exists", str(destination.parent))
    for _, destination in moves:
        destination.parent.mkdir(parents=True, exist_ok=True)
    for path, destination in moves:
        os.replace(path, destination)
