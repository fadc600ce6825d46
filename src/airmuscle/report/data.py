"""Chapters as plain data for JSON: all quantities and tables, numbers in SI units.

    {chapter: {"title", "summary": [...], "problems": [...], "notes": [...],
               quantity: value, ..., table: [{column: value, ...}, ...], ...,
               "settings": [...], "references": [...], "units": {...}}}

Keys are the names with underscores: `rms error` is `rms_error`. `units` gives the SI unit of each value, `rms_error`,
and of each column of a table, `parameters.value`; "by row" is that of the column `unit`. A long series is in its file
in data/ alone.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .chapter import Chapter, Table
from .formula import to_plain


def as_data(chapters: Sequence[Chapter]) -> dict[str, Any]:
    """The chapters as plain data by their names."""
    return {_key(chapter.name): _chapter(chapter) for chapter in chapters}


def _chapter(chapter: Chapter) -> dict[str, Any]:
    tables = [table for table in chapter.tables if not table.series]
    return {
        "title": to_plain(chapter.title),
        "summary": list(map(to_plain, chapter.paragraphs)),
        "problems": list(chapter.problems),
        "notes": list(map(to_plain, chapter.notes)),
        **{_key(each.name): each.value for each in chapter.values},
        **{_key(table.key): _rows(table) for table in tables},
        "settings": [{"quantity": what, "value": value, "source": source} for what, value, source in chapter.chosen],
        "references": list(map(str, chapter.references)),
        "units": {
            **{_key(each.name): each.unit for each in chapter.values if each.unit},
            **{f"{_key(table.key)}.{_key(name)}": column.unit
               for table in tables for name, column in table.columns.items() if column.unit},
        },
    }  # fmt: skip


def _rows(table: Table) -> list[dict[str, Any]]:
    keys, columns = [_key(name) for name in table.columns], table.columns.values()
    return [dict(zip(keys, row, strict=True)) for row in zip(*(each.values for each in columns), strict=True)]


def _key(name: str) -> str:
    return re.sub(r"[^\w.\[\]]+", "_", to_plain(name)).strip("_")


def as_json(content: Any) -> str:
    """Return standard JSON: NumPy values become plain ones, values that are not finite become null."""
    return json.dumps(_json_value(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _json_value(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _json_value(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _json_value(value.tolist())
    if isinstance(value, list | tuple):
        return [_json_value(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def in_words(chapter: Chapter, words: Callable[[str], str]) -> Chapter:
    """The chapter with its texts in the words of an outlet, such as hints that name options."""

    def cell(value: Any) -> Any:
        return words(value) if isinstance(value, str) else value

    def table(each: Table) -> Table:
        columns = {name: dataclasses.replace(column, values=list(map(cell, column.values)))
                   for name, column in each.columns.items()}  # fmt: skip
        return dataclasses.replace(each, columns=columns)

    return dataclasses.replace(
        chapter,
        summary=tuple(map(words, chapter.paragraphs)),
        tables=tuple(map(table, chapter.tables)),
        values=tuple(dataclasses.replace(each, value=cell(each.value)) for each in chapter.values),
        problems=tuple(map(words, chapter.problems)),
        notes=tuple(map(words, chapter.notes)),
    )
