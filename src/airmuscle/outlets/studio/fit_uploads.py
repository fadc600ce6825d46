"""Uploads of the tab Fit: sets of measurement files in a temporary folder, within limits of number
and size.

A set has a random identifier, which only the page that uploaded it knows; it is made when its first
file was accepted. A file appears under its name when it is complete. The folder of a server that
was killed is removed by the next one.
"""

import functools
import os
import re
import secrets
import shutil
import tempfile
import threading
import time
import unicodedata
from collections.abc import AsyncIterator, Callable
from pathlib import Path

from ...bench.readers.formats.format_table import EPISODE_EXTENSIONS
from ...core import is_running
from .security import BadRequest

MAX_FILE = 32 * 10**6
MAX_SET = 64 * 10**6
"""Largest size of a measurement file, and of all files of a set [bytes] (chosen)."""
MAX_FILES = 400
MAX_SETS = 40
"""Maximum number of files of a set, and of sets that the server keeps (chosen)."""
MAX_NAME = 120
"""Maximum length of the name of a file (chosen)."""
FILES = "files"
ACCEPTED = (*EPISODE_EXTENSIONS, ".zip")
"""Extensions of measurement files and of episodes."""
IsNeeded = Callable[[str], bool]
_PREFIX = "airmuscle-studio-"
_IDENTIFIER = re.compile(r"[A-Za-z0-9_-]{22}")
_FORBIDDEN = set('<>:"/\\|?*')


def check_file_name(name: str) -> str:
    """The name of an uploaded file in composed characters. Raises BadRequest for a path and for an
    unknown format.
    """
    name = unicodedata.normalize("NFC", name)
    shown = "".join(c if c.isprintable() else "?" for c in name)[:60]
    if (
        not name.isprintable()
        or _FORBIDDEN & set(name)
        or name != name.strip(" ")
        or name.startswith(".")
    ):
        raise BadRequest(
            f"'{shown}' is no name of a file; rename it, without folders and special characters."
        )
    if len(name.encode()) > MAX_NAME:
        raise BadRequest(
            f"'{shown}…': the name of the file has more than {MAX_NAME} bytes; shorten it."
        )
    if Path(name).suffix.lower() not in ACCEPTED:
        raise BadRequest(
            f"'{shown}' is of no supported format; supported extensions are {', '.join(ACCEPTED)}."
        )
    return name


class UploadStore:
    """The sets of files, each in a folder of its own."""

    def __init__(self, parent: Path | None = None) -> None:
        self._parent, self._lock = parent, threading.Lock()
        self._used: dict[str, float] = {}

    def new_set(self, is_needed: IsNeeded) -> str:
        """The identifier of a new set; of too many, the one that has been idle for the longest time
        makes room, one without files first. Raises BadRequest if all are needed.
        """
        with self._lock:
            if len(self._used) >= MAX_SETS:
                filled = {name: any((self._top / name / FILES).iterdir()) for name in self._used}
                idle = [name for name in self._used if not is_needed(name)]
                if not idle:
                    text = (
                        f"the server keeps {MAX_SETS} sets of files, and all are in use; try again"
                        " later."
                    )
                    raise BadRequest(text, 503)
                oldest = min(idle, key=lambda name: (filled[name], self._used[name]))
                shutil.rmtree(self._top / oldest, ignore_errors=True)
                del self._used[oldest]
            identifier = secrets.token_urlsafe(16)
            (self._top / identifier / FILES).mkdir(parents=True, mode=0o700)
            self._used[identifier] = time.monotonic()
        return identifier

    def folder(self, identifier: str) -> Path:
        """The folder of a set. Raises BadRequest if it is not kept."""
        with self._lock:
            if not _IDENTIFIER.fullmatch(identifier) or identifier not in self._used:
                raise BadRequest("these files are no longer on the server; drop them again.", 404)
            self._used[identifier] = time.monotonic()
            return self._top / identifier

    def names(self, identifier: str) -> list[str]:
        """The names of the files of a set, in order."""
        return sorted(path.name for path in (self.folder(identifier) / FILES).iterdir())

    async def add(
        self, identifier: str, name: str, parts: AsyncIterator[bytes], is_needed: IsNeeded
    ) -> str:
        """Add a file, or replace the one of this name; the identifier of the set, of a new one if
        none is given. Raises BadRequest beyond the limits; then there is no new set."""
        folder = self.folder(identifier) if identifier else None
        stored = (
            [path for path in (folder / FILES).iterdir() if path.name != name] if folder else []
        )
        if len(stored) >= MAX_FILES:
            raise BadRequest(f"at most {MAX_FILES} files are fitted together; remove some.", 413)
        allowed = MAX_SET - sum(path.stat().st_size for path in stored)
        unfinished = self._top / f"{secrets.token_hex(8)}.part"
        try:
            size = 0
            with unfinished.open("wb") as file:
                async for part in parts:
                    size += len(part)
                    if size > MAX_FILE:
                        raise BadRequest(
                            f"{name} is larger than {MAX_FILE // 10**6} MB; export fewer rows.", 413
                        )
                    if size > allowed:
                        raise BadRequest(
                            f"all files are larger than {MAX_SET // 10**6} MB; remove some.", 413
                        )
                    file.write(part)
            if not size:
                raise BadRequest(f"{name} is empty.")
            identifier = identifier or self.new_set(is_needed)
            unfinished.replace(self.folder(identifier) / FILES / name)
        finally:
            unfinished.unlink(missing_ok=True)
        return identifier

    def remove(self, identifier: str, name: str) -> None:
        """Remove a file of a set."""
        if name not in self.names(identifier):
            raise BadRequest("this file is not on the server.", 404)
        (self.folder(identifier) / FILES / name).unlink(missing_ok=True)

    def stop(self) -> None:
        """Remove all files."""
        if "_top" in vars(self):  # it was made
            shutil.rmtree(self._top, ignore_errors=True)

    @functools.cached_property
    def _top(self) -> Path:
        """A folder that only this user can read; those of servers that were killed are removed
        before it is made.
        """
        parent = self._parent or Path(tempfile.gettempdir())
        for old in parent.glob(f"{_PREFIX}*"):
            process = old.name.removeprefix(_PREFIX).partition("-")[0]
            if process.isdecimal() and not old.is_symlink() and not is_running(int(process)):
                shutil.rmtree(old, ignore_errors=True)
        return Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-", dir=parent))
