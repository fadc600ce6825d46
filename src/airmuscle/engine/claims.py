"""Claims of a process on tasks in a folder that several processes share."""

from __future__ import annotations

import contextlib
import os
import time
import uuid
from pathlib import Path

HEARTBEAT = 1.5
"""Interval at which a process renews its claims [s] (chosen)."""
EXPIRY = 6.0
"""Time without renewal after which a claim is taken over [s] (chosen)."""


class Claims:
    """The claims of a process in a shared folder: files that it creates, renews by their time stamp, and removes.

    A claim that is not renewed for `EXPIRY`, by the clock of this process, is renamed and thereby taken over. If two
    processes compute a task nevertheless, after a suspension, their results are equal and the file is replaced.
    """

    def __init__(self, folder: Path, owner: str) -> None:
        self._folder, self._owner = folder, owner
        self._held: set[str] = set()
        self._seen: dict[str, tuple[int, float]] = {}
        self._renewed = time.monotonic()
        self.contended = False

    def take(self, key: str) -> bool:
        """Claim a task; false if another process holds it."""
        path = self._path(key)
        if self._expired(key, path):
            with contextlib.suppress(OSError):  # taken over by another process
                path.rename(taken := path.with_name(f"{path.name}-{uuid.uuid4().hex}"))
                taken.unlink()
        try:
            descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
        except FileExistsError:
            return False
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(self._owner)
        self._held.add(key)
        return True

    def _expired(self, key: str, path: Path) -> bool:
        """Whether the time stamp of a claim has been unchanged for too long."""
        try:
            stamp = path.stat().st_mtime_ns
        except OSError:
            self._seen.pop(key, None)
            return False
        now = time.monotonic()
        last, since = self._seen.get(key, (-1, now))
        if stamp != last:
            self._seen[key] = stamp, now
            return False
        return now - since > EXPIRY

    def renew(self) -> None:
        """Renew the time stamps of the claims of this process, if it is time."""
        if time.monotonic() - self._renewed > HEARTBEAT:
            self._renewed = time.monotonic()
            for key in self._held:
                with contextlib.suppress(OSError):  # taken over
                    os.utime(self._path(key))

    def release(self, key: str) -> None:
        """Remove a claim."""
        self._held.discard(key)
        with contextlib.suppress(OSError):
            self._path(key).unlink()

    def release_all(self) -> None:
        """Remove all claims of this process."""
        for key in list(self._held):
            self.release(key)

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.claim"
