"""Addresses of the tab Fit: upload of files, what was understood, and the tasks with their results,
which wait in a queue: few run at a time, each in a process that can be ended. A task has a random
identifier, which only the page that started it knows, and the page may be closed meanwhile.

POST /api/fit/file?set=ID&name=NAME   a measurement file; without a set a new one is begun
POST /api/fit/remove                  {"set": ID, "name": NAME}
POST /api/fit/read                    {"set": ID, "settings": {...}}: columns, runs, problems and
                                      points
POST /api/fit/start                   the same: the identifier of a task
GET  /api/fit/task/ID                 state and progress
POST /api/fit/task/ID/cancel
GET  /api/fit/task/ID/FILE            result.json, report.html, muscle.toml, report.zip
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
from ..requests import RequestError
from .arm_task import ArmTexts, read_arm_settings, sheet_of_episodes
from .fit_settings import FitSettings, read_settings
from .fit_task import DOWNLOADS, RESULT, run_fit, sheet_of_files
from .fit_uploads import UploadStore, check_file_name
from .security import BadRequest, json_answer, limited_table
from .worker import LimitedWorker, Task

MAX_SETTINGS = 256 * 1024
"""Largest size of the settings [bytes] (chosen)."""
TIME_LIMIT = 1800.0
READING_LIMIT = 90.0
"""Limits [s] of a fit, and of the reading of a set (chosen)."""
FIT_WORKERS = 2
MAX_WAITING = 20
MAX_TASKS = 200
"""Number of fits at a time and of fits that wait, and of tasks whose state and result the server
keeps (chosen).
"""
WAITING = "waiting"
RUNNING = "running"
DONE = "done"
FAILED = "failed"
CANCELLED = "cancelled"
_TYPES = {
    "html": "text/html",
    "toml": "application/toml",
    "zip": "application/zip",
    "json": "application/json",
}


@dataclasses.dataclass(eq=False)
class FitTask:
    """A fit that waits, runs or has ended: completed fraction, what is being done, and the error
    with its field.
    """

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
    """Fits in order of their arrival. `task` is called with the arguments of a fit and a function
    for its progress.
    """

    def __init__(
        self, task: Task, count: int = FIT_WORKERS, make_worker: Callable[[], Any] = LimitedWorker
    ) -> None:
        self._task = task
        self._count = count
        self._make_worker = make_worker
        self._tasks: collections.OrderedDict[str, FitTask] = collections.OrderedDict()
        self._running: dict[str, Any] = {}
        self._threads: list[threading.Thread] = []
        self._changed = threading.Condition()
        self._stopped = False

    def submit(self, set_name: str, folder: Path, *arguments: Any) -> str:
        """The identifier of a new task, which receives `arguments` after the folder of its result.
        Raises BadRequest if too many wait."""
        identifier = secrets.token_urlsafe(16)
        out = folder / "tasks" / identifier
        with self._changed:
            if len(self._in(WAITING)) >= MAX_WAITING:
                raise BadRequest(f"{MAX_WAITING} fits wait already; try again later.", 503)
            task = FitTask(identifier, set_name, out, (str(folder), str(out), *arguments))
            self._tasks[identifier] = task
            for old in self._in(DONE, FAILED, CANCELLED)[: max(0, len(self._tasks) - MAX_TASKS)]:
                shutil.rmtree(self._tasks.pop(old.identifier).folder, ignore_errors=True)
            if len(self._threads) < self._count:
                self._threads.append(
                    threading.Thread(target=self._serve, name="airmuscle studio fit", daemon=True)
                )
                self._threads[-1].start()
            self._changed.notify()
        return identifier

    def _in(self, *states: str) -> list[FitTask]:
        """The tasks in these states, in the order of their arrival."""
        return [task for task in list(self._tasks.values()) if task.state in states]

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
            waiting = self._in(WAITING)
            before = waiting.index(task) if task in waiting else 0
        shown = {key: getattr(task, key) for key in ("state", "fraction", "text", "error", "field")}
        return {**shown, "before": before}

    def is_needed(self, set_name: str) -> bool:
        """Whether a task of a set waits or runs."""
        return any(task.set_name == set_name for task in self._in(WAITING, RUNNING))

    def cancel(self, identifier: str) -> None:
        """End a task that waits or runs; its result is not written."""
        task = self.find(identifier)
        with self._changed:
            if task.state in (WAITING, RUNNING):
                task.state = CANCELLED
            worker = self._running.get(identifier)
            if worker is not None:  # the worker takes no other task until this lock is free
                worker.kill()

    def stop(self) -> None:
        """End all tasks and processes."""
        with self._changed:
            self._stopped = True
            workers = list(self._running.values())
            self._changed.notify_all()
        for worker in workers:
            worker.kill()
        for thread in self._threads:
            thread.join(5.0)

    def _serve(self) -> None:
        worker = self._make_worker()
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopped or self._in(WAITING))
                if self._stopped:
                    break
                task = self._in(WAITING)[0]
                task.state = RUNNING
                self._running[task.identifier] = worker
            self._run(task, worker)
        worker.stop()

    def _run(self, task: FitTask, worker: Any) -> None:
        def report(fraction: float, text: str) -> None:
            task.fraction = fraction
            task.text = text
            if task.state == CANCELLED:  # cancelled while the process was started
                worker.kill()

        state = DONE
        error = ""
        field = ""
        try:
            worker.call(self._task, task.arguments, TIME_LIMIT, report)
        except AirmuscleError as reason:
            state = FAILED
            error = str(reason)
            field = reason.field if isinstance(reason, RequestError) else ""
        except Exception as reason:
            state = FAILED
            error = f"the fit ended without a result ({type(reason).__name__})."
        if state != DONE:  # what a process that was ended has left
            shutil.rmtree(task.folder, ignore_errors=True)
        with self._changed:
            del self._running[task.identifier]
            if task.state == RUNNING:
                task.state = state
                task.error = error
                task.field = field


class FitService:
    """The files and the tasks of the tab Fit."""

    def __init__(
        self, pool: Any, uploads: UploadStore | None = None, queue: FitQueue | None = None
    ) -> None:
        self._pool, self._uploads, self._queue = (
            pool,
            uploads or UploadStore(),
            queue or FitQueue(run_fit),
        )

    def routes(self) -> list[Any]:
        """The routes for the application."""
        from starlette.routing import Route

        changing = {
            "file": self.add_file,
            "remove": self.remove_file,
            "read": self.read,
            "start": self.start,
            "task/{task}/cancel": self.cancel,
        }
        reading = {"task/{task}": self.status, "task/{task}/{name}": self.file}
        routes = [
            Route(f"/api/fit/{path}", handler, methods=["POST"])
            for path, handler in changing.items()
        ]
        return routes + [Route(f"/api/fit/{path}", handler) for path, handler in reading.items()]

    def stop(self) -> None:
        """End all tasks and remove all files."""
        self._queue.stop()
        self._uploads.stop()

    async def add_file(self, request: Any) -> Any:
        """Store a file, in a new set unless one is given; returns the set and its files."""
        name = check_file_name(request.query_params.get("name", ""))
        stated = request.query_params.get("set", "")
        identifier = await self._uploads.add(stated, name, request.stream(), self._queue.is_needed)
        return json_answer({"set": identifier, "files": self._uploads.names(identifier)})

    async def remove_file(self, request: Any) -> Any:
        """Remove a file; returns the remaining ones."""
        wanted = await limited_table(request, MAX_SETTINGS)
        self._uploads.remove(_name(wanted, "set"), _name(wanted, "name"))
        return json_answer({"set": wanted["set"], "files": self._uploads.names(wanted["set"])})

    async def read(self, request: Any) -> Any:
        """What was understood of the files of a set."""
        from starlette.concurrency import run_in_threadpool

        _, folder, settings = await self._given(request)
        task = sheet_of_files if isinstance(settings, FitSettings) else sheet_of_episodes
        sheet = await run_in_threadpool(
            self._pool.call, task, str(folder), settings, limit=READING_LIMIT
        )
        return json_answer(sheet)

    async def start(self, request: Any) -> Any:
        """Start a fit; returns the identifier of its task."""
        return json_answer({"task": self._queue.submit(*await self._given(request))})

    async def _given(self, request: Any) -> tuple[str, Path, FitSettings | ArmTexts]:
        """A set, its folder, and the settings of measurement files of a muscle, or of episodes of
        an arm.
        """
        wanted = await limited_table(request, MAX_SETTINGS)
        name = _name(wanted, "set")
        settings = wanted.get("settings", {})
        folder = self._uploads.folder(name)
        is_arm = isinstance(settings, dict) and settings.get("record") == "arm"
        return name, folder, read_arm_settings(settings) if is_arm else read_settings(settings)

    async def status(self, request: Any) -> Any:
        """State and progress of a task."""
        return json_answer(self._queue.status(request.path_params["task"]))

    async def cancel(self, request: Any) -> Any:
        """End a task."""
        self._queue.cancel(request.path_params["task"])
        return await self.status(request)

    async def file(self, request: Any) -> Any:
        """A file of a result."""
        from starlette.responses import FileResponse

        task = self._queue.find(request.path_params["task"])
        name = request.path_params["name"]
        path = task.folder / name
        shown = None if name == RESULT else name
        if name not in (RESULT, *DOWNLOADS) or task.state != DONE or not path.is_file():
            raise BadRequest("this fit has no such file.", 404)
        self._uploads.folder(task.set_name)  # a set whose result is read is not idle
        return FileResponse(path, media_type=_TYPES[name.rpartition(".")[2]], filename=shown)


def _name(wanted: dict[str, Any], key: str) -> str:
    name = wanted.get(key)
    if not isinstance(name, str):
        raise BadRequest(f"the request must state '{key}'.")
    return name
