"""Page of the studio: its files, and one self-contained file of what is on the page or of given
sheets.
"""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib import metadata, resources
from pathlib import Path
from typing import Any

from ...core import FileError, ParameterError, atomic_file
from .joint_sheet import joint_names, sheet_of_joint
from .tasks import sheet_of_any

MAX_PAGE_SHEETS = 12
MAX_MUSCLES = 6
"""Maximum number of muscles and plants in a self-contained page, and of muscles in one chart
(chosen).
"""
_NAMES = """
    numbers units roots beyond-range law elements source figure chart outline parameters points-file muscle-chart muscle-point
    muscle-points muscle-curves muscle-tab
    plant-start plant-run plant-drawing plant-traces plant-tab fit-source fit-scatter fit-data fit-arm fit-files
    fit-result fit-tab joint-loop joint-statics joint-linear joint-drawing joint-charts joint-tab size-tab main
"""  # noqa: E501
SCRIPTS = ("vendor/uPlot.iife.min.js", *(f"scripts/{name}.js" for name in _NAMES.split()))
"""Scripts in the order in which the page runs them."""
STYLES = ("vendor/uPlot.min.css", "style.css", "fit.css")
SERVER_ONLY = ("scripts/fit-", "fit.css")
"""Beginnings of the names of files that need a server, which a page without one does not
contain.
"""
LICENCE = "vendor/uPlot.LICENSE"
TYPES = {".js": "text/javascript", ".css": "text/css", ".LICENSE": "text/plain"}


def web_file(name: str) -> str:
    """The text of a file of the page."""
    return (
        resources.files(__package__).joinpath("web", *name.split("/")).read_text(encoding="utf-8")
    )


def names_without_server(names: Sequence[str]) -> list[str]:
    """The names of the files that a page without a server needs."""
    return [name for name in names if not name.startswith(SERVER_ONLY)]


def web_files() -> dict[str, tuple[str, str]]:
    """Type and text of every file of the page by its name; nothing else can be requested."""
    return {
        name: (next(kind for end, kind in TYPES.items() if name.endswith(end)), web_file(name))
        for name in (*SCRIPTS, *STYLES, LICENCE)
    }


def server_page() -> str:
    """The page as the server sends it: scripts and styles are separate files."""
    head = "\n".join(f'<link rel="stylesheet" href="web/{name}">' for name in STYLES)
    scripts = "\n".join(f'<script src="web/{name}" defer></script>' for name in SCRIPTS)
    return page_of("", f"{head}\n{scripts}", "")


def self_contained_page(sheets: Sequence[Mapping[str, Any]], state: Mapping[str, Any]) -> str:
    """One file without server and network: sheets with their programs, and the state of the page.
    Its policy allows the scripts and styles in it by their digests, and nothing else."""
    data = {
        "state": state,
        "sheets": [{k: v for k, v in s.items() if k != "script"} for s in sheets],
    }
    embedded = (
        json.dumps(data).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    )
    *scripts, last = map(web_file, names_without_server(SCRIPTS))
    scripts += [*(sheet["script"] for sheet in sheets), last]
    scripts = [
        text.replace("</", "<\\/").replace("<!--", "<\\!--") for text in scripts
    ]  # no text ends its element
    styles = list(map(web_file, names_without_server(STYLES)))
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_digest, scripts))}; style-src"
        f" {' '.join(map(_digest, styles))}; img-src data: blob:; base-uri 'none'; form-action"
        " 'none'"
    )
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
    head += "\n".join(f"<style>{text}</style>" for text in styles)
    licence = web_file(LICENCE).replace("--", "- -")
    comment = f"<!--\nuPlot, in the first script, is used under this licence:\n\n{licence}\n-->"
    body = f'<script type="application/json" id="embedded">{embedded}</script>\n'
    return page_of(comment, head, body + "\n".join(f"<script>{text}</script>" for text in scripts))


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def page_of(comment: str, head: str, end: str) -> str:
    """The page with a comment before it, with the elements of its head, and those at its end."""
    page = web_file("index.html").replace("@version@", metadata.version("airmuscle"))
    return (
        page.replace("<!--comment-->", comment)
        .replace("<!--head-->", head)
        .replace("<!--end-->", end)
    )


def open_sheets(names: Sequence[str]) -> tuple[dict[str, Any], ...]:
    """The sheets of muscles, laws and plants by name or by path. Raises the errors of their
    loaders.
    """
    if len(names) > MAX_PAGE_SHEETS:
        raise ParameterError(
            f"{len(names)} names are given; allowed range: at most {MAX_PAGE_SHEETS}."
        )
    return tuple(sheet_of_any(name) for name in names)


def first_state(sheets: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The state of a page that begins with these sheets."""
    named = [
        {"text": sheet["own_text"]} if sheet.get("own_text") else {"name": sheet["name"]}
        for sheet in sheets
    ]
    muscles = [
        {**name, "values": {}}
        for name, sheet in zip(named, sheets, strict=True)
        if "plant" not in sheet
    ]
    plants = [name for name, sheet in zip(named, sheets, strict=True) if "plant" in sheet]
    return {
        "tab": "muscle" if muscles else "plant",
        "muscle": {"muscles": muscles[:MAX_MUSCLES], "active": 0},
        "plant": plants[0] if plants else {"name": ""},
    }


def export_page(names: Sequence[str], path: str | Path) -> Path:
    """Write a page without server and network that shows these muscles and plants; the file is
    complete or unchanged.

    A joint of the library appears in the tab Joint as well. Raises the errors of the loaders,
    ParameterError without a name, FileError if the file cannot be written.
    """
    if not names:
        raise ParameterError(
            "no muscle or plant is named; give at least one name of the library or a file."
        )
    sheets = open_sheets(names)
    shown = {sheet["name"]: None for sheet in sheets if "plant" in sheet and not sheet["own_text"]}
    joints = tuple(sheet_of_joint(name) for name in shown if name in joint_names())
    state = first_state(sheets) | ({"joint": {"name": joints[0]["name"]}} if joints else {})
    text = self_contained_page((*sheets, *joints), state)
    path = Path(path)
    try:
        with atomic_file(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror}).") from None
    return path
