"""Worker processes of the studio: tasks on texts of users, with limits of time and memory.

A task that exceeds its limit of time is ended with its process; the next task starts a new one. A text of a user is
never read in the process of the server.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any

from ...core.errors import AirmuscleError, InputError, printable

MEMORY = 4 * 2**30
"""Largest data memory of a worker [bytes] (chosen); it is not limited on Windows and macOS."""
Report = Callable[[float, str], None]
"""Receives the progress of a task: the completed fraction and what is being done."""
_END = 5.0
"""Limit [s] of the end of a process that was killed (chosen)."""
_ENDED = "the computation ended without a result, for lack of memory; give a smaller model."
_START = 60.0
"""Limit [s] of the start of a process with its imports (chosen)."""


class LimitError(InputError):
    """A task took more time or memory than is allowed, or all workers are occupied."""


class Worker:
    """One process that runs one task at a time."""

    def __init__(self) -> None:
        self._process: Any = None
        self._pipe: Connection | None = None
        self._starting = threading.Lock()

    def call(
        self, task: Callable[..., Any], arguments: tuple[Any, ...], limit: float, report: Report | None = None
    ) -> Any:
        """The result of `task(*arguments)`. Raises what the task raises, LimitError after `limit` [s].

        With `report`, the task receives as last argument a function for its progress, and `report` what it is told.
        """
        if self._process is None or not self._process.is_alive():
            self._start()
        pipe = self._pipe
        if pipe is None:  # the pool was stopped meanwhile
            raise LimitError(_ENDED)
        if report is not None:
            report(0.0, "starting")  # a task that was cancelled while the process was started ends here
        end = time.monotonic() + limit
        try:
            pipe.send((task, arguments, report is not None))
            progress, content = True, (None, None)
            while progress:
                if not pipe.poll(max(0.0, end - time.monotonic())):
                    self.stop()
                    raise LimitError(f"the computation takes more than {limit:g} s; give a smaller model or file.")
                progress, content = pipe.recv()
                if progress and report is not None:
                    report(*content)
            result, error = content
        except (EOFError, OSError):
            self.stop()
            raise LimitError(_ENDED) from None
        if error is not None:
            raise error
        return result

    def _start(self) -> None:
        self.stop()
        context = multiprocessing.get_context("spawn")
        pipe, other = context.Pipe()
        process = context.Process(target=serve_tasks, args=(other,), name="airmuscle studio", daemon=True)
        with self._starting:
            process.start()
            self._process, self._pipe = process, pipe
        other.close()
        try:
            started = pipe.poll(_START) and pipe.recv() == "ready"
        except (EOFError, OSError):
            started = False
        if not started:
            self.stop()
            raise LimitError("no process could be started for the computation.")

    def kill(self) -> None:
        """End the process from another thread; the call that waits for it raises LimitError."""
        with self._starting:
            process = self._process
        if process is not None:
            process.kill()
            process.join(_END)

    def stop(self) -> None:
        """End the process; several threads may do so, of which one closes its pipe."""
        with self._starting:
            process, self._process = self._process, None
            pipe, self._pipe = self._pipe, None
        if process is not None:
            process.kill()
            process.join()
        if pipe is not None:
            pipe.close()


def serve_tasks(pipe: Connection) -> None:
    """Run the tasks that arrive through a pipe until it is closed, in a process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all processes; the parent ends this one
    threading.Thread(target=_exit_with_parent, name="parent watchdog", daemon=True).start()
    _limit_memory()
    warnings.simplefilter("ignore")
    with contextlib.suppress(EOFError, OSError):
        pipe.send("ready")
        while True:
            task, arguments, reports = pipe.recv()
            if reports:
                arguments = (*arguments, lambda fraction, text: pipe.send((True, (fraction, text))))
            pipe.send((False, _outcome(task, arguments)))
    os._exit(0)


def _exit_with_parent() -> None:
    """End this process as soon as the server has ended, also during a task."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _outcome(task: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[Any, Exception | None]:
    try:
        return task(*arguments), None
    except AirmuscleError as error:
        return None, error
    except MemoryError:
        return None, LimitError("the computation needs more memory than is allowed; give a smaller model or file.")
    except Exception as error:  # the reason belongs to the terminal of the server, not to the page
        print(printable(f"airmuscle studio: {type(error).__name__}: {error}"), file=sys.stderr)
        return None, InputError("this input cannot be processed; the terminal of the server states the reason.")


def _limit_memory() -> None:
    if sys.platform != "linux":
        return
    import resource

    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    limit = MEMORY if hard == resource.RLIM_INFINITY else min(MEMORY, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


SPARE = 2
"""Number of idle workers that a pool keeps ready (chosen): two long tasks may begin at once beside a short one."""


class WorkerPool:
    """Some workers, which are started when they are needed; with `warm`, SPARE more than are occupied are kept ready.

    `warm` is a task without arguments that a new worker runs once, so that its imports delay nobody.
    """

    def __init__(self, count: int, warm: Callable[[], Any] | None = None) -> None:
        self._all = [Worker() for _ in range(count)]
        self._free: queue.LifoQueue[Worker] = queue.LifoQueue()
        self._warm = warm
        self._unused = list(self._all) if warm else []
        for worker in [] if warm else self._all:
            self._free.put(worker)

    def prepare(self, count: int = 1) -> None:
        """Start further workers, each in a thread of its own, as far as there are some that were never started."""
        with contextlib.suppress(IndexError):
            for _ in range(count):
                arguments = (self._unused.pop(),)
                threading.Thread(target=self._start, args=arguments, name="airmuscle studio spare", daemon=True).start()

    def _start(self, worker: Worker) -> None:
        try:
            if self._warm is not None:
                worker.call(self._warm, (), _START)
        except LimitError:
            worker.stop()  # it starts again with its next task
        self._free.put(worker)

    def call(self, task: Callable[..., Any], *arguments: Any, limit: float) -> Any:
        """The result of a task in a free worker. Raises what it raises, LimitError after `limit` [s]."""
        end = time.monotonic() + limit
        with self._borrowed(limit) as worker:
            return worker.call(task, arguments, max(0.1, end - time.monotonic()))

    @contextlib.contextmanager
    def _borrowed(self, limit: float) -> Iterator[Worker]:
        if self._free.empty():
            self.prepare()
        try:
            worker = self._free.get(timeout=limit)
        except queue.Empty:
            raise LimitError("all workers of the studio are occupied; try again later.") from None
        if self._free.qsize() < SPARE:
            self.prepare()
        try:
            yield worker
        finally:
            self._free.put(worker)

    def stop(self) -> None:
        """End all processes."""
        self._unused.clear()
        for worker in self._all:
            worker.stop()
