"""Addresses of the tab Fit: upload of files, what was understood, and the tasks with their results.

POST /api/fit/file?set=ID&name=NAME   a measurement file; without a set a new one is begun
POST /api/fit/remove                  {"set": ID, "name": NAME}
POST /api/fit/read                    {"set": ID, "settings": {...}}: columns, runs, problems and points
POST /api/fit/start                   the same: the identifier of a task
GET  /api/fit/task/ID                 state and progress
POST /api/fit/task/ID/cancel
GET  /api/fit/task/ID/FILE            result.json, report.html, muscle.toml, report.zip
"""

import json
from typing import Any

from .arm_task import ArmSettings, read_arm_settings, sheet_of_episodes
from .fit_queue import DONE, FitQueue
from .fit_settings import FitSettings, read_settings
from .fit_sheet import sheet_of_files
from .fit_task import DOWNLOADS, RESULT, run_fit
from .fit_uploads import UploadStore, check_file_name
from .security import BadRequest, decoded, json_answer, limited_body

MAX_SETTINGS = 256 * 1024
"""Largest size of the settings [bytes] (chosen)."""
READING_LIMIT = 90.0
"""Limit [s] of the reading of a set (chosen)."""
_TYPES = {"html": "text/html", "toml": "application/toml", "zip": "application/zip", "json": "application/json"}


class FitService:
    """The files and the tasks of the tab Fit."""

    def __init__(self, pool: Any, uploads: UploadStore | None = None, queue: FitQueue | None = None) -> None:
        self._pool, self._uploads, self._queue = pool, uploads or UploadStore(), queue or FitQueue(run_fit)

    def routes(self) -> list[Any]:
        """The routes for the application."""
        from starlette.routing import Route

        return [
            Route("/api/fit/file", self.add_file, methods=["POST"]),
            Route("/api/fit/remove", self.remove_file, methods=["POST"]),
            Route("/api/fit/read", self.read, methods=["POST"]),
            Route("/api/fit/start", self.start, methods=["POST"]),
            Route("/api/fit/task/{task}", self.status),
            Route("/api/fit/task/{task}/cancel", self.cancel, methods=["POST"]),
            Route("/api/fit/task/{task}/{name}", self.file),
        ]

    def stop(self) -> None:
        """End all tasks and remove all files."""
        self._queue.stop()
        self._uploads.stop()

    async def add_file(self, request: Any) -> Any:
        """Store a file, in a new set unless one is given; returns the set and its files."""
        name = check_file_name(request.query_params.get("name", ""))
        given = request.query_params.get("set", "")
        identifier = await self._uploads.add(given, name, request.stream(), self._queue.is_needed)
        return json_answer({"set": identifier, "files": self._uploads.names(identifier)})

    async def remove_file(self, request: Any) -> Any:
        """Remove a file; returns the remaining ones."""
        wanted = await _content(request)
        self._uploads.remove(_name(wanted, "set"), _name(wanted, "name"))
        return json_answer({"set": wanted["set"], "files": self._uploads.names(wanted["set"])})

    async def read(self, request: Any) -> Any:
        """What was understood of the files of a set."""
        from starlette.concurrency import run_in_threadpool

        wanted = await _content(request)
        folder, settings = self._uploads.folder(_name(wanted, "set")), _settings(wanted)
        task = sheet_of_episodes if isinstance(settings, ArmSettings) else sheet_of_files
        sheet = await run_in_threadpool(self._pool.call, task, str(folder), settings, limit=READING_LIMIT)
        return json_answer(sheet)

    async def start(self, request: Any) -> Any:
        """Start a fit; returns the identifier of its task."""
        wanted = await _content(request)
        name, settings = _name(wanted, "set"), _settings(wanted)
        return json_answer({"task": self._queue.submit(name, self._uploads.folder(name), settings)})

    async def status(self, request: Any) -> Any:
        """State and progress of a task."""
        return json_answer(self._queue.status(request.path_params["task"]))

    async def cancel(self, request: Any) -> Any:
        """End a task."""
        self._queue.cancel(request.path_params["task"])
        return json_answer(self._queue.status(request.path_params["task"]))

    async def file(self, request: Any) -> Any:
        """A file of a result."""
        from starlette.responses import FileResponse

        task, name = self._queue.find(request.path_params["task"]), request.path_params["name"]
        path = task.folder / name
        if name not in (RESULT, *DOWNLOADS) or task.state != DONE or not path.is_file():
            raise BadRequest("this fit has no such file.", 404)
        self._uploads.folder(task.set_name)  # a set whose result is read is not idle
        kind = _TYPES[name.rpartition(".")[2]]
        shown = None if name == RESULT else name
        return FileResponse(path, media_type=kind, filename=shown)


def _settings(wanted: dict[str, Any]) -> FitSettings | ArmSettings:
    """The settings of measurement files of a muscle, or of episodes of an arm."""
    given = wanted.get("settings", {})
    return (
        read_arm_settings(given) if isinstance(given, dict) and given.get("record") == "arm" else read_settings(given)
    )


def _name(wanted: dict[str, Any], key: str) -> str:
    name = wanted.get(key)
    if not isinstance(name, str):
        raise BadRequest(f"the request must state '{key}'.")
    return name


async def _content(request: Any) -> dict[str, Any]:
    """The table in the body of a request. Raises BadRequest."""
    try:
        content = json.loads(decoded(await limited_body(request, MAX_SETTINGS)))
    except (ValueError, RecursionError):
        raise BadRequest("the request is not JSON.") from None
    if not isinstance(content, dict):
        raise BadRequest("the request must be a table.")
    return content
