"""Queue of fits: a bounded number waits, few run at a time, each in a process that can be ended.

A task has a random identifier, which only the page that started it knows, and the page may be closed meanwhile.
"""

import collections
import dataclasses
import secrets
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...core import AirmuscleError
from ..requests.declaration import RequestError
from .security import BadRequest
from .worker import LimitedWorker, LimitError

FIT_WORKERS = 2
"""Maximum number of fits at a time (chosen)."""
TIME_LIMIT = 1800.0
"""Limit [s] of a fit (chosen)."""
MAX_WAITING = 20
"""Maximum number of fits that wait (chosen)."""
MAX_TASKS = 200
"""Number of tasks whose state and result the server keeps (chosen)."""
WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"


@dataclasses.dataclass(eq=False)
class FitTask:
    """A fit that waits, runs or has ended: completed fraction, what is being done, and the error with its field."""

    identifier: str
    set_name: str
    folder: Path
    arguments: tuple[Any, ...]
    state: str = WAITING
    fraction: float = 0.0
    text: str = ""
    error: str = ""
    field: str = ""


class FitQueue:
    """Fits in order of their arrival. `task` is called with the arguments of a fit and a function for its progress."""

    def __init__(
        self, task: Callable[..., Any], count: int = FIT_WORKERS, make_worker: Callable[[], Any] = LimitedWorker
    ) -> None:
        self._task, self._count, self._make_worker = task, count, make_worker
        self._tasks: collections.OrderedDict[str, FitTask] = collections.OrderedDict()
        self._waiting: collections.deque[FitTask] = collections.deque()
        self._running: dict[str, Any] = {}
        self._threads: list[threading.Thread] = []
        self._changed = threading.Condition()
        self._stopped = False

    def submit(self, set_name: str, folder: Path, *arguments: Any) -> str:
        """The identifier of a new task, which receives `arguments` after the folder of its result.

        Raises BadRequest if too many wait.
        """
        identifier = secrets.token_urlsafe(16)
        out = folder / "tasks" / identifier
        with self._changed:
            if len(self._waiting) >= MAX_WAITING:
                raise BadRequest(f"{MAX_WAITING} fits wait already; try again later.", 503)
            task = FitTask(identifier, set_name, out, (str(folder), str(out), *arguments))
            self._tasks[identifier] = task
            self._waiting.append(task)
            self._forget_old()
            if len(self._threads) < self._count:
                thread = threading.Thread(target=self._serve, name="airmuscle studio fit", daemon=True)
                self._threads.append(thread)
                thread.start()
            self._changed.notify()
        return identifier

    def _forget_old(self) -> None:
        ended = [name for name, task in self._tasks.items() if task.state not in (WAITING, RUNNING)]
        for name in ended[: max(0, len(self._tasks) - MAX_TASKS)]:
            shutil.rmtree(self._tasks.pop(name).folder, ignore_errors=True)

    def find(self, identifier: str) -> FitTask:
        """A task. Raises BadRequest if it is not kept."""
        task = self._tasks.get(identifier)
        if task is None:
            raise BadRequest("this fit is no longer on the server; start it again.", 404)
        return task

    def status(self, identifier: str) -> dict[str, Any]:
        """State, progress and error of a task, and the number of fits before it."""
        task = self.find(identifier)
        with self._changed:
            before = self._waiting.index(task) if task in self._waiting else 0
        keys = ("state", "fraction", "text", "error", "field")
        return {**{key: getattr(task, key) for key in keys}, "before": before}

    def is_needed(self, set_name: str) -> bool:
        """Whether a task of a set waits or runs."""
        return any(t.set_name == set_name and t.state in (WAITING, RUNNING) for t in list(self._tasks.values()))

    def cancel(self, identifier: str) -> None:
        """End a task that waits or runs; its result is not written."""
        task = self.find(identifier)
        with self._changed:
            if task.state == WAITING:
                self._waiting.remove(task)
            if task.state in (WAITING, RUNNING):
                task.state = CANCELLED
            worker = self._running.get(identifier)
            if worker is not None:  # the worker takes no other task until this lock is free
                worker.kill()

    def stop(self) -> None:
        """End all tasks and processes."""
        with self._changed:
            self._stopped = True
            self._waiting.clear()
            workers = list(self._running.values())
            self._changed.notify_all()
        for worker in workers:
            worker.kill()
        for thread in self._threads:
            thread.join(5.0)

    def _serve(self) -> None:
        worker = self._make_worker()
        while (task := self._next(worker)) is not None:
            self._run(task, worker)
            with self._changed:
                del self._running[task.identifier]
        worker.stop()

    def _next(self, worker: Any) -> FitTask | None:
        with self._changed:
            while not self._waiting and not self._stopped:
                self._changed.wait()
            if self._stopped:
                return None
            task = self._waiting.popleft()
            task.state = RUNNING
            self._running[task.identifier] = worker
            return task

    def _run(self, task: FitTask, worker: Any) -> None:
        def report(fraction: float, text: str) -> None:
            task.fraction, task.text = fraction, text
            if task.state == CANCELLED:  # cancelled while the process was started
                worker.kill()

        state, error, field = DONE, "", ""
        try:
            worker.call(self._task, task.arguments, TIME_LIMIT, report)
        except LimitError as reason:
            state, error = FAILED, str(reason)
        except AirmuscleError as reason:
            state, error = FAILED, str(reason)
            field = reason.field if isinstance(reason, RequestError) else ""
        except Exception as reason:
            state, error = FAILED, f"the fit ended without a result ({type(reason).__name__})."
        if state != DONE:  # what a process that was ended has left
            shutil.rmtree(task.folder, ignore_errors=True)
        with self._changed:
            if task.state == RUNNING:
                task.state, task.error, task.field = state, error, field
