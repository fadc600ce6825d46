"""Worker processes of the studio: tasks on texts of users, with limits of time and memory.

A task that exceeds its limit of time is ended with its process; the next task starts a new one. A
text of a user is never read in the process of the server.
"""

import queue
import sys
import threading
import time
import warnings
from collections.abc import Callable
from typing import Any

from ...core import AirmuscleError, InputError, printable
from ...engine.processes import START_LIMIT, Report, Worker, WorkerError

MEMORY = 4 * 2**30
"""Largest data memory of a worker [bytes] (chosen); it is not limited on Windows and macOS."""
Task = Callable[..., Any]


class LimitError(InputError):
    """A task took more time or memory than is allowed, or all workers are occupied."""


class LimitedWorker:
    """A process that runs one task at a time, with limits of time and memory and messages for a
    page. `kill` ends it from another thread, and the call that waits for it raises LimitError;
    `stop` ends it between calls.
    """

    def __init__(self) -> None:
        self._worker = Worker(_prepare)
        self.kill = self._worker.kill
        self.stop = self._worker.stop

    def call(
        self, task: Task, arguments: tuple[Any, ...], limit: float, report: Report | None = None
    ) -> Any:
        """The result of `task(*arguments)`, as `Worker.call`. Raises LimitError after `limit`
        [s].
        """
        try:
            return self._worker.call(run_task, (task, *arguments), limit, report)
        except WorkerError as error:
            late = f"takes more than {limit:g} s; give a smaller model or file."
            memory = "ended without a result, for lack of memory; give a smaller model."
            raise LimitError(f"the computation {late if error.late else memory}") from None


def run_task(task: Task, *arguments: Any) -> Any:
    """The result of a task in a process of its own. Raises AirmuscleError with a message for the
    page.
    """
    try:
        return task(*arguments)
    except AirmuscleError:
        raise
    except MemoryError:
        raise LimitError(
            "the computation needs more memory than is allowed; give a smaller model or file."
        ) from None
    except Exception as error:  # the reason belongs to the terminal of the server, not to the page
        print(printable(f"airmuscle studio: {type(error).__name__}: {error}"), file=sys.stderr)
        raise InputError(
            "this input cannot be processed; the terminal of the server states the reason."
        ) from None


def _prepare() -> None:
    """Ignore warnings, and limit the data memory of this process on Linux."""
    warnings.simplefilter("ignore")
    if sys.platform != "linux":
        return
    import resource

    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    limit = MEMORY if hard == resource.RLIM_INFINITY else min(MEMORY, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


SPARE = 2
"""Number of idle workers that a pool keeps ready (chosen): two long tasks may begin at once beside
a short one.
"""


class WorkerPool:
    """Some workers, which are started when they are needed, one at a time, so that the first one is
    ready soon; with `warm`, a task that a new worker runs once for its imports, SPARE more than are
    occupied are kept ready.
    """

    def __init__(self, count: int, warm: Callable[[], Any] | None = None) -> None:
        self._all = [LimitedWorker() for _ in range(count)]
        self._free: queue.LifoQueue[LimitedWorker] = queue.LifoQueue()
        self._warm = warm
        self._unused = list(self._all) if warm else []
        self._starting = threading.Lock()
        if not warm:
            for worker in self._all:
                self._free.put(worker)

    def prepare(self, idle: int = SPARE) -> None:
        """Start workers in a thread until some are idle, as far as there are some that were never
        started.
        """
        if self._unused and self._free.qsize() < idle:
            threading.Thread(
                target=self._start, args=(idle,), name="airmuscle studio spare", daemon=True
            ).start()

    def _start(self, idle: int) -> None:
        with self._starting:
            while self._unused and self._free.qsize() < idle:
                worker = self._unused.pop()
                try:
                    if self._warm is not None:
                        worker.call(self._warm, (), START_LIMIT)
                except LimitError:
                    worker.stop()  # it starts again with its next task
                self._free.put(worker)

    def call(self, task: Task, *arguments: Any, limit: float) -> Any:
        """The result of a task in a free worker. Raises what it raises, LimitError after `limit`
        [s].
        """
        end = time.monotonic() + limit
        if self._free.empty():
            self.prepare()
        try:
            worker = self._free.get(timeout=limit)
        except queue.Empty:
            raise LimitError("all workers of the studio are occupied; try again later.") from None
        self.prepare()
        try:
            return worker.call(task, arguments, max(0.1, end - time.monotonic()))
        finally:
            self._free.put(worker)

    def stop(self) -> None:
        """End all processes."""
        self._unused.clear()
        for worker in self._all:
            worker.stop()
