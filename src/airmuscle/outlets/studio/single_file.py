"""Self-contained page: sheets of the library or of files, written as one file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...core.atomic_output import atomic_file
from ...core.errors import FileError, ParameterError
from .app import MAX_PAGE_SHEETS
from .joint_sheet import joint_names, sheet_of_joint
from .page import self_contained_page
from .tasks import sheet_of_any

MAX_MUSCLES = 6
"""Maximum number of muscles in one chart (chosen)."""


def open_sheets(names: Sequence[str]) -> tuple[dict[str, Any], ...]:
    """The sheets of muscles, laws and plants by name or by path. Raises the errors of their loaders."""
    if len(names) > MAX_PAGE_SHEETS:
        raise ParameterError(f"{len(names)} names are given; allowed range: at most {MAX_PAGE_SHEETS}.")
    return tuple(sheet_of_any(name) for name in names)


def first_state(sheets: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The state of a page that begins with these sheets."""
    laws = [sheet for sheet in sheets if "plant" not in sheet]
    muscles = [_named(sheet) | {"values": {}} for sheet in laws]
    plants = [sheet for sheet in sheets if "plant" in sheet]
    plant = _named(plants[0]) if plants else {"name": ""}
    return {
        "tab": "muscle" if muscles else "plant",
        "muscle": {"muscles": muscles[:MAX_MUSCLES], "active": 0},
        "plant": plant,
    }


def _named(sheet: dict[str, Any]) -> dict[str, Any]:
    """What the state of a page contains of a sheet: the text of a file, or a name of the library."""
    return {"text": sheet["own_text"]} if sheet.get("own_text") else {"name": sheet["name"]}


def export_page(names: Sequence[str], path: str | Path) -> Path:
    """Write a page without server and network that shows these muscles and plants; the file is complete or unchanged.

    A joint of the library appears in the tab Joint as well. Raises the errors of the loaders, ParameterError without a
    name, FileError if the file cannot be written.
    """
    if not names:
        raise ParameterError("no muscle or plant is named; give at least one name of the library or a file.")
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
