"""Application of the studio: the page, sheets of the library, and sheets of texts of users.

The server computes no curve and no run: it sends printed programs, which the page evaluates.
"""

import collections
import threading
from collections.abc import Callable, Mapping
from importlib import metadata
from typing import Any

from ...core import AirmuscleError
from ...files.library.files import read_toml
from ...files.library.folders import LAWS, PLANTS, list_laws, list_plants
from ..requests import (
    BraidRequest,
    FitRequest,
    JointFitRequest,
    ReadingRequest,
    RequestError,
    form_fields,
)
from . import tasks
from .fit_routes import FitService
from .joint_sheet import joint_names, sheet_of_joint
from .page import MAX_PAGE_SHEETS, self_contained_page, server_page, web_files
from .security import (
    Access,
    Application,
    BadRequest,
    json_answer,
    limited_table,
    limited_text,
    secured,
)
from .worker import LimitError, Task, WorkerPool

WORKERS = 5
LONG_WORKERS = 3
"""Number of worker processes for sheets, some of which are kept ready, and of those for what may
take long: measurement files, sizings and joints (chosen)."""
TIME_LIMIT = 20.0
"""Limit [s] of the computation of a sheet of a user (chosen)."""
LIBRARY_LIMIT = 120.0
"""The same of the library, and of a sizing (chosen: a joint with an elaborate law takes some
seconds).
"""
MAX_SHEETS = 100
MAX_PAGE = 256 * 1024
"""Number of sheets that the server keeps, and largest size of a request for a self-contained page
[bytes] (chosen).
"""
LONG_TASKS = (sheet_of_joint, tasks.size_sheet)
"""Tasks that leave the workers of the other sheets free."""
SHEETS: Mapping[str, tuple[str, Callable[[], Any], Callable[[str], dict[str, Any]]]] = {
    "law": ("muscle or law", list_laws, tasks.sheet_of_law),
    "plant": ("plant", list_plants, tasks.sheet_of_library_plant),
    "joint": ("joint", joint_names, sheet_of_joint),
}
"""Sheets of the library by their address: what they are, their names, and the task that makes
one.
"""


def library_list() -> dict[str, Any]:
    """Names and titles of the laws and plants that the page offers."""
    listed: dict[str, Any] = {
        "version": metadata.version("airmuscle"),
        "laws": [],
        "plants": [],
        "joints": [],
    }
    names_of = {
        "laws": (LAWS, list_laws()),
        "plants": (PLANTS, list_plants()),
        "joints": (PLANTS, joint_names()),
    }
    for kind, (folder, names) in names_of.items():
        for name in names:
            tables = read_toml(folder / f"{name}.toml")
            row = {
                "name": name,
                "title": tables["title"],
                "provenance": tables.get("provenance", "chosen"),
            }
            listed[kind].append(row)
    fit = [
        field
        for request in (ReadingRequest, BraidRequest, FitRequest)
        for field in form_fields(request)
    ]
    return {
        **listed,
        "forms": {"size": tasks.size_form(), "fit": fit, "arm": form_fields(JointFitRequest)},
    }


def create_app(
    access: Access = Access(),
    pool: WorkerPool | None = None,
    opened: tuple[dict[str, Any], ...] = (),
    fits: FitService | None = None,
    long_pool: WorkerPool | None = None,
) -> Application:
    """The ASGI application. `opened` are sheets with which the page begins. Raises ImportError
    without starlette. `long_pool` computes joints and sizings, by default `pool`."""
    from starlette.applications import Starlette
    from starlette.requests import ClientDisconnect
    from starlette.routing import Route

    pool = pool or WorkerPool(WORKERS)
    handlers = Handlers(pool, long_pool or pool, access, opened)
    routes = [
        Route("/", handlers.page),
        Route("/web/{name:path}", handlers.web),
        Route("/program/{name}", handlers.program),
        Route("/api/library", handlers.library),
        Route("/api/law", handlers.of_text(tasks.sheet_of_law_text), methods=["POST"]),
        Route("/api/plant", handlers.of_text(tasks.sheet_of_scenario_text), methods=["POST"]),
        *(Route(f"/api/{kind}/{{name}}", handlers.of_library(kind)) for kind in SHEETS),
        Route("/api/size", handlers.of_text(tasks.size_sheet, LIBRARY_LIMIT), methods=["POST"]),
        Route("/api/page", handlers.save_page, methods=["POST"]),
        *(fits or FitService(pool)).routes(),
    ]
    errors: dict[Any, Any] = {
        AirmuscleError: _refused,
        ClientDisconnect: _stating(
            "the connection was closed.", 400
        ),  # nobody receives it: the tab was closed
        **{status: _stating("there is no such address.", status) for status in (404, 405)},
        500: _stating("the server failed; its terminal states the reason.", 500),
    }
    return secured(Starlette(routes=routes, exception_handlers=errors), access)


HERE = "./"
"""Address of the page relative to itself, because a proxy may serve it below a path."""


class Handlers:
    """The functions that answer requests, and the sheets that were requested last, by their
    identifier.
    """

    def __init__(
        self,
        pool: WorkerPool,
        long_pool: WorkerPool,
        access: Access,
        opened: tuple[dict[str, Any], ...],
    ) -> None:
        from starlette import responses

        self._pool = pool
        self._long_pool = long_pool
        self._access = access
        self._opened = opened
        self._kept: collections.OrderedDict[str, dict[str, Any]] = collections.OrderedDict()
        self._of_library: dict[tuple[str, str], str] = {}
        self._lock = threading.Lock()
        self._web, self._page, self._library, self._responses = (
            web_files(),
            server_page(),
            library_list(),
            responses,
        )
        for sheet in opened:
            self._keep(sheet)

    def _get(self, identifier: str) -> dict[str, Any] | None:
        with self._lock:
            return self._kept.get(identifier)

    def _keep(self, sheet: dict[str, Any]) -> None:
        with self._lock:
            self._kept[sheet["id"]] = sheet
            self._kept.move_to_end(sheet["id"])
            if len(self._kept) > MAX_SHEETS:
                self._kept.popitem(last=False)

    def _sheet(self, task: Task, text: str, limit: float, in_library: bool) -> dict[str, Any]:
        """The sheet that a task makes of a text, within a limit of time [s]; of the library a kept
        one.
        """
        key = (task.__name__, text)
        sheet = self._get(self._of_library.get(key, "")) if in_library else None
        if sheet is None:
            sheet = (self._long_pool if task in LONG_TASKS else self._pool).call(
                task, text, limit=limit
            )
            self._keep(sheet)
            if in_library:
                self._of_library[key] = sheet["id"]
        return sheet

    async def page(self, request: Any) -> Any:
        """The page; a token in its address becomes a cookie, so that it does not stay in the
        address.
        """
        if cookie := self._access.cookie(request.scope):
            answer = self._responses.RedirectResponse(HERE, status_code=303)
            answer.set_cookie(**cookie)
            return answer
        return self._responses.HTMLResponse(self._page)

    async def web(self, request: Any) -> Any:
        """A file of the page."""
        kind, text = self._web.get(request.path_params["name"], ("", ""))
        if not kind:
            raise BadRequest("there is no such file.", 404)
        return self._responses.Response(text, media_type=kind)

    async def program(self, request: Any) -> Any:
        """The printed program of a sheet."""
        sheet = self._get(request.path_params["name"].removesuffix(".js"))
        if sheet is None:
            raise BadRequest("this program is no longer kept; reload the page.", 404)
        return self._responses.Response(sheet["script"], media_type="text/javascript")

    async def library(self, request: Any) -> Any:
        """Names of the library, and the sheets with which the page begins."""
        return json_answer(
            {**self._library, "opened": [_without_script(sheet) for sheet in self._opened]}
        )

    def of_library(self, kind: str) -> Callable[[Any], Any]:
        """The handler of the sheets of a law, a plant or a joint of the library."""
        what, names, task = SHEETS[kind]

        async def handle(request: Any) -> Any:
            name = request.path_params["name"]
            if name not in names():
                raise BadRequest(f"the library has no {what} '{name[:80]}'.", 404)
            return await self._computed(task, name, LIBRARY_LIMIT, True)

        return handle

    def of_text(
        self, task: Callable[[str], dict[str, Any]], limit: float = TIME_LIMIT
    ) -> Callable[[Any], Any]:
        """The handler of the sheets that a task makes of texts of users."""

        async def handle(request: Any) -> Any:
            text = await limited_text(request, tasks.MAX_TEXT)
            return await self._computed(task, text, limit, False)

        return handle

    async def _computed(self, *arguments: Any) -> Any:
        from starlette.concurrency import run_in_threadpool

        return json_answer(_without_script(await run_in_threadpool(self._sheet, *arguments)))

    async def save_page(self, request: Any) -> Any:
        """One file of what is on the screen, without fits: the request names the sheets and the
        state of the page.
        """
        wanted = await limited_table(request, MAX_PAGE)
        names = wanted.get("sheets")
        state = wanted.get("state")
        if (
            not isinstance(state, dict)
            or not isinstance(names, list)
            or not all(isinstance(n, str) for n in names)
        ):
            raise BadRequest("the request must contain sheets, a list of identifiers, and a state.")
        if not 1 <= len(names) <= MAX_PAGE_SHEETS:
            raise BadRequest(
                f"{len(names)} sheets are requested; allowed range: 1 to {MAX_PAGE_SHEETS}."
            )
        sheets = [sheet for sheet in map(self._get, names) if sheet is not None]
        if len(sheets) < len(names):
            raise BadRequest("a program is no longer kept; reload the page.", 404)
        shown = {name: tab for name, tab in state.items() if name != "fit"}
        return self._responses.HTMLResponse(self_contained_page(sheets, shown))


def _without_script(sheet: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in sheet.items() if key != "script"}


async def _refused(request: Any, error: Exception) -> Any:
    assert isinstance(error, AirmuscleError)
    status = (
        error.status
        if isinstance(error, BadRequest)
        else 503
        if isinstance(error, LimitError)
        else 422
    )
    field = {"field": error.field} if isinstance(error, RequestError) else {}
    return json_answer({"error": str(error.message), **field}, status)


def _stating(text: str, status: int) -> Callable[[Any, Any], Any]:
    """The handler of an error that has one text."""

    async def answer(request: Any, error: Any) -> Any:
        return json_answer({"error": text}, status)

    return answer
