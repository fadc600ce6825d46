"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..core.errors import FileError


@contextlib.contextmanager
def atomic_folder(folder: Path | str) -> Iterator[Path]:
    """A fresh empty folder whose files move into `folder` once the block has ended well.

    When the block raises, or the files cannot be written, `folder` stays as it was, and does not appear if it
    was not there. Files of the same name are replaced, others left alone. Raises FileError.
    """
    target = Path(folder)
    with _as_file_error(target):
        made = _missing(target)
    try:
        with _as_file_error(target):
            target.mkdir(parents=True, exist_ok=True)
            place = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=target))
        try:
            yield place
            with _as_file_error(target):
                _move_up(place, target)
        finally:
            shutil.rmtree(place, ignore_errors=True)
    except BaseException:
        _remove_empty(made)
        raise


def check_writable(folder: Path | str) -> None:
    """Raise FileError now, before long work, where `staged` could not write later; leaves nothing behind."""
    target = Path(folder)
    with _as_file_error(target):
        made = _missing(target)
    try:
        with atomic_folder(target):
            return
    finally:
        _remove_empty(made)


@contextlib.contextmanager
def _as_file_error(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        at = f" ({error.filename})" if error.filename and Path(error.filename) != target else ""
        raise FileError(
            f"{target}: cannot be written to: {error.strerror or error}{at}. Name a folder that you may write to."
        ) from error


def _missing(folder: Path) -> list[Path]:
    """The folders that `mkdir(parents=True)` would make, innermost first."""
    return [path for path in (folder, *folder.parents) if not path.exists()]


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        with contextlib.suppress(OSError):  # never made, or something else has since been put there
            folder.rmdir()


def _move_up(place: Path, target: Path) -> None:
    """Move every file to its place in `target`; the folders of all exist before the first file moves."""
    files = sorted(path for path in place.rglob("*") if path.is_file())
    moves = [(path, target / path.relative_to(place)) for path in files]
    for _, goal in moves:
        if goal.is_dir():
            raise IsADirectoryError(21, "a folder of that name is there", str(goal))
        if goal.parent.exists() and not goal.parent.is_dir():
            raise NotADirectoryError(20, "a file of that name is there", str(goal.parent))
    for _, goal in moves:
        goal.parent.mkdir(parents=True, exist_ok=True)
    for path, goal in moves:
        os.replace(path, goal)
