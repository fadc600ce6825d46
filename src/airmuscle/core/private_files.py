"""Files and folders that belong to the user and that nobody else may write to, read through a
descriptor that follows no link."""

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_POSIX = hasattr(os, "getuid")
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_WITHOUT_LINKS = getattr(os, "O_NOFOLLOW", 0)
# A pipe is not waited for.
_FILE_FLAGS = _WITHOUT_LINKS | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0)
_RELATIVE = os.open in os.supports_dir_fd
"""Whether a file can be opened in an open folder, so that the folder cannot be exchanged before."""


class PrivateContent(NamedTuple):
    """The content of a private file; without one, the reason why the file is not read, which is
    empty where it is missing."""

    content: bytes | None
    refusal: str = ""


def read_private(path: Path, folder: int | None = None) -> PrivateContent:
    """The content of a regular file that belongs to the user and that nobody else may write to.

    folder  descriptor of the folder that contains the file; by default the path is opened as it is
    """
    try:
        if folder is None or not _RELATIVE:
            descriptor = os.open(path, os.O_RDONLY | _FILE_FLAGS)
        else:
            descriptor = os.open(path.name, os.O_RDONLY | _FILE_FLAGS, dir_fd=folder)
    except FileNotFoundError:
        return PrivateContent(None)
    except OSError as error:
        reason = "it is a link" if path.is_symlink() else error.strerror or str(error)
        return PrivateContent(None, reason)
    try:
        state = os.fstat(descriptor)
        if not stat.S_ISREG(state.st_mode):
            return PrivateContent(None, "it is no regular file")
        if refusal := _refusal(state):
            return PrivateContent(None, refusal)
        with open(descriptor, "rb", closefd=False) as file:
            return PrivateContent(file.read())
    except OSError as error:
        return PrivateContent(None, error.strerror or str(error))
    finally:
        os.close(descriptor)


class PrivateFolder(NamedTuple):
    """The descriptor of an open folder, if the system has one; otherwise the reason of a refusal,
    which is empty where the folder may be used."""

    descriptor: int | None
    refusal: str = ""


@contextlib.contextmanager
def open_private_folder(path: Path) -> Iterator[PrivateFolder]:
    """A context manager for a folder that is no link, belongs to the user, and to which nobody else
    may write. Raises OSError for a folder that is missing.
    """
    if not _RELATIVE:
        yield PrivateFolder(None, "it is a link" if path.is_symlink() else "")
        return
    if path.is_symlink():
        yield PrivateFolder(None, "it is a link")
        return
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | _WITHOUT_LINKS)
    try:
        yield PrivateFolder(descriptor, _refusal(os.fstat(descriptor)))
    finally:
        os.close(descriptor)


def _refusal(state: os.stat_result) -> str:
    """Why a file or folder in this state is not private; empty if it is."""
    if not _POSIX:
        return ""
    if state.st_uid != os.getuid():
        return "it belongs to another user"
    if state.st_mode & _WRITABLE_BY_OTHERS:
        return "other users may write to it"
    return ""
