"""Self-contained page: sheets of the library or of files, written as one file."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.errors import FileError, ParameterError
from .app import MAX_PAGE_SHEETS
from .page import self_contained_page
from .tasks import sheet_of_law


def open_sheets(names: Sequence[str]) -> tuple[dict[str, Any], ...]:
    """The sheets of muscles, laws and plants by name or by path. Raises the errors of their loaders."""
    if len(names) > MAX_PAGE_SHEETS:
        raise ParameterError(f"{len(names)} names are given; allowed range: at most {MAX_PAGE_SHEETS}.")
    return tuple(_with_text(sheet_of_law(name)) for name in names)


def _with_text(sheet: dict[str, Any]) -> dict[str, Any]:
    """The sheet with its file, so that a permanent address contains it."""
    return {**sheet, "own_text": sheet["toml"]["unchanged"]}


def export_page(names: Sequence[str], path: str | Path) -> Path:
    """Write a page without server and network that shows these muscles; the file is complete or unchanged.

    Raises the errors of the loaders, ParameterError without a name, FileError if the file cannot be written.
    """
    if not names:
        raise ParameterError("no muscle is named; give at least one name of the library or a muscle file.")
    sheets = open_sheets(names)
    muscles = [{"text": sheet["own_text"], "values": {}} for sheet in sheets]
    text = self_contained_page(sheets, {"tab": "muscle", "muscle": {"muscles": muscles[:6], "active": 0}})
    path = Path(path)
    unfinished = path.with_name(f"{path.name}.part")
    try:
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            unfinished.unlink()
        raise FileError(f"{path}: cannot be written ({error.strerror}).") from None
    return path
