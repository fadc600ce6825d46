"""Store of results: the results of the tasks of a long computation as files in a folder, so that
the same computation goes on from them after an interruption.

A file begins with the key of its task and the SHA-256 of what follows; its content is JSON and
arrays (`stored_form`). The key is a digest of all that determines the result: the program, the
function, its common argument and the task. What is damaged, exchanged, a link or a pipe, or may
have been written by another user, is computed anew, with a warning that names the file.
"""

import contextlib
import functools
import hashlib
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NamedTuple

from ..core import AirmuscleWarning, InputError, atomic_file, program_fingerprint
from ..core.private_files import open_private_folder, read_private
from ..core.tree import EXCLUDED_ROOMS
from .content import PROGRAM, content_digest
from .stored_form import NotStorableError, decode, encode

STORE_FOLDER = "tasks"
"""Folder of the stored results of a command, in that of its output."""
CHECKPOINT = "checkpoint-"
"""Beginning of the keys of unfinished computations."""
_SUFFIX = ".result"
_MAGIC = b"airmuscle result 1\n"
_MODE = 0o700
_FILE_MODE = 0o600


class Stored(NamedTuple):
    """A result that was found in a store."""

    value: Any


class ResultStore:
    """The results of tasks in one folder, which is created with the first of them.

    `recalled` and `saved` count the results that were read and written; `resumed` is called when
    the first one is read. `has_checkpoints`: whether one is of an unfinished computation.
    """

    def __init__(self, folder: Path, resumed: Callable[[], object] = lambda: None) -> None:
        self.folder = folder
        self.recalled = 0
        self.saved = 0
        self.has_checkpoints = any(folder.glob(f"{CHECKPOINT}*{_SUFFIX}"))
        self._resumed = resumed
        self._usable = True
        if os.path.lexists(folder):
            self._check_private()
        if self._usable:
            for leftover in folder.glob(f".*{_SUFFIX}.*.part"):  # of a process that was killed
                with contextlib.suppress(OSError):
                    leftover.unlink()

    def _check_private(self) -> None:
        """Do without the folder, with a warning, if others may have written to it."""
        try:
            with open_private_folder(self.folder) as opened:
                refusal = opened.refusal
        except OSError as error:
            refusal = error.strerror or str(error)
        if refusal:
            self._usable = False
            _warn(
                f"{self.folder} is not used: {refusal}. All results are computed, and none is"
                " stored. Remove it to have results stored."
            )

    def load(self, key: str) -> Stored | None:
        """The stored result of a task; None where there is none that is valid, with a warning where
        a file is not.
        """
        if not self._usable:
            return None
        path = self._path(key)
        try:
            with open_private_folder(self.folder) as opened:
                content, refusal = (
                    (None, opened.refusal)
                    if opened.refusal
                    else read_private(path, opened.descriptor)
                )
        except OSError:  # removed meanwhile
            return None
        stored = None if content is None else _checked(key, content)
        if stored is None:
            if content is not None:
                refusal = "it is damaged, or the result of another task"
            if refusal:
                _warn(f"{path} is not used: {refusal}. Its result is computed anew.")
            return None
        self.recalled += 1
        if self.recalled == 1:
            self._resumed()
        return stored

    def save(self, key: str, value: Any) -> None:
        """Store the result of a task; a result that cannot be stored is named in a warning."""
        if not self._usable:
            return
        try:
            content = encode(value)
        except NotStorableError as error:
            _warn(f"results are not stored: {error.message}. They are computed anew each time.")
            return
        path = self._path(key)
        try:
            self.folder.mkdir(mode=_MODE, parents=True, exist_ok=True)
            with atomic_file(path) as unfinished:
                _write_private(unfinished, _header(key, content) + content)
        except OSError as error:
            _warn(
                f"{self.folder}: results cannot be stored: {error.strerror or error}. They are"
                " computed anew each time. Free space, or specify another folder."
            )
        else:
            self.saved += 1
            self.has_checkpoints = self.has_checkpoints or key.startswith(CHECKPOINT)

    def remove(self) -> None:
        """Remove all results, and the folder if nothing else is in it."""
        if not self._usable:
            return
        for path in self.folder.glob(f"*{_SUFFIX}"):
            with contextlib.suppress(OSError):
                path.unlink()
        with contextlib.suppress(OSError):  # something else is in it
            self.folder.rmdir()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}{_SUFFIX}"


def _checked(key: str, content: bytes) -> Stored | None:
    """The result in a file; None unless it is that of the key, and complete."""
    header = len(_header(key, b""))
    payload = content[header:]
    if content[:header] != _header(key, payload):
        return None
    try:
        return Stored(decode(payload))
    except Exception:  # written by another program under the same key
        return None


def _header(key: str, payload: bytes) -> bytes:
    checksum = hashlib.sha256(key.encode() + b"\n" + payload).hexdigest()
    return _MAGIC + f"{key}\n{checksum}\n".encode()


def _write_private(path: Path, content: bytes) -> None:
    """Write a new file that only the user may read and write, whatever the mask of the process."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    path.unlink(missing_ok=True)
    with open(os.open(path, flags, _FILE_MODE), "wb") as file:
        file.write(content)


def _warn(text: str) -> None:
    warnings.warn(text, AirmuscleWarning, stacklevel=4)


_current: ContextVar[ResultStore | None] = ContextVar("result_store", default=None)


@contextlib.contextmanager
def result_store(
    folder: Path | str, resumed: Callable[[], object] = lambda: None
) -> Iterator[ResultStore]:
    """A context manager within which the results of all tasks are stored in a folder, and taken
    from there if an earlier, interrupted call has stored them.

    This holds for `run_study`, `compare`, `bootstrap`, `identify_campaign`, `tune`,
    `compare_controllers`, `fit_joint`, `size_muscles` and `roll_out`, whoever computes the tasks.
    A result is that of a computation without a store, to the last bit. The folder may be removed at
    any time; `ResultStore.remove` does so. Nobody but the user may write to it. `resumed` is called
    when the first stored result is read.
    """
    store = ResultStore(Path(folder), resumed)
    token = _current.set(store)
    try:
        yield store
    finally:
        _current.reset(token)


def current_store() -> ResultStore | None:
    """The store of the present block, if there is one."""
    return _current.get()


class TaskKeys:
    """The keys of the tasks of one function with one common content; None, with a warning, where
    they cannot be determined.
    """

    def __init__(self, function: str, common: Any) -> None:
        """`function` is the name of the computation, which begins with its module."""
        try:
            self._common: str | None = content_digest(_program_of(function), function, common)
        except InputError as error:
            _warn(f"results of {function} are not stored: {error.message}.")
            self._common = None

    def of(self, tasks: Sequence[Any]) -> list[str | None]:
        """The key of each task."""
        if self._common is None:
            return [None] * len(tasks)
        return [self._key(task) for task in tasks]

    def _key(self, task: Any) -> str | None:
        try:
            return content_digest(self._common, task)
        except InputError as error:
            _warn(f"a result is not stored: {error.message}.")
            return None


@functools.cache
def _program_of(function: str) -> str:
    """The fingerprint of the program with the room of a function."""
    room = function.removeprefix(f"{PROGRAM}.").partition(".")[0]
    return program_fingerprint(tuple(name for name in EXCLUDED_ROOMS if name != room))
