"""Distribution of independent calls by an executor, and claims of a process on the tasks of a
shared folder.
"""

import contextlib
import functools
import os
import pickle
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from pathlib import Path
from typing import Any

from ..core import SimulationError
from .processes import check_running

HEARTBEAT = 1.5
"""Interval at which a process renews its claims [s] (chosen)."""
EXPIRY = 6.0
"""Time without renewal after which a claim is taken over [s] (chosen)."""
Call = Callable[[Any, Any], Any]


class Claims:
    """The claims of a process in a shared folder: files that it creates, renews by their time
    stamp, and removes.

    A claim that is not renewed for `EXPIRY`, by the clock of this process, is renamed and thereby
    taken over. If two processes compute a task nevertheless, after a suspension, their results are
    equal and the file is replaced.
    """

    def __init__(self, folder: Path, owner: str) -> None:
        self._folder = folder
        self._owner = owner
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


class DistributedCalls:
    """Calls `function(common, task)` by an executor, or one after the other in this process without
    one.

    `common` is pickled once, when the first call is sent, and loaded once by each worker. The
    function is one of a module; its result must not depend on which worker computes it, nor on the
    calls before.
    """

    def __init__(self, executor: Executor | None, function: Call, common: Any) -> None:
        self._executor = executor
        self._function = function
        self._common = common

    @functools.cached_property
    def _pickled(self) -> bytes:
        return pickle.dumps(self._common, protocol=5)

    def completed(self, tasks: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Index and result of each task, as completed. Raises what a call raises; SimulationError
        at a crash.
        """
        if self._executor is None:
            yield from ((i, self._function(self._common, task)) for i, task in enumerate(tasks))
            return
        futures: dict[Future[Any], int] = {}
        try:
            for i, task in enumerate(tasks):
                futures[self._executor.submit(_call, self._function, self._pickled, task)] = i
            for future in as_completed(futures):
                yield (
                    futures.pop(future),
                    future.result(),
                )  # removed at once, to bound the memory of a long study
        except BrokenExecutor:
            raise SimulationError(
                "a worker process died, possibly for lack of memory. Run the same command again,"
                " with fewer workers."
            ) from None
        finally:
            for future in futures:
                future.cancel()

    def results(
        self, tasks: Sequence[Any], done: Callable[[int], object] = lambda count: None
    ) -> list[Any]:
        """The results in the order of the tasks; `done` is called with the number of those that are
        completed.
        """
        found: list[Any] = [None] * len(tasks)
        for count, (i, result) in enumerate(self.completed(tasks), 1):
            found[i] = result
            done(count)
        return found


def _call(function: Call, pickled: bytes, task: Any) -> Any:
    check_running()
    return function(_load(pickled), task)


@functools.lru_cache(maxsize=1)
def _load(pickled: bytes) -> Any:
    return pickle.loads(pickled)
