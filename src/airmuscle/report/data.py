"""Chapters as plain data: for JSON all quantities and tables, for the page in the browser as they
are shown.

    {chapter: {"title", "summary": [...], "problems": [...], "notes": [...],
               quantity: value, ..., table: [{column: value, ...}, ...], ...,
               "settings": [...], "references": [...], "units": {...}}}

Keys are the names with underscores: `rms error` is `rms_error`. `units` gives the SI unit of each
value, `rms_error`, and of each column of a table, `parameters.value`; "by row" is that of the
column `unit`. A long series is in its file.
"""

import csv
import dataclasses
import functools
import io
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

from ..core import printable
from .chapter import Chapter, Table
from .formatting import to_plain
from .shown import shown_columns, value_text


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
        **{_key(named.name): named.value for named in chapter.values},
        **{_key(table.key): _rows(table) for table in tables},
        "settings": [
            {"quantity": what, "value": value, "source": source}
            for what, value, source in chapter.chosen
        ],
        "references": list(map(str, chapter.references)),
        "units": {
            **{_key(named.name): named.unit for named in chapter.values if named.unit},
            **{
                f"{_key(table.key)}.{_key(name)}": column.unit
                for table in tables
                for name, column in table.columns.items()
                if column.unit
            },
        },
    }


def _rows(table: Table) -> list[dict[str, Any]]:
    keys = [_key(name) for name in table.columns]
    columns = table.columns.values()
    return [
        dict(zip(keys, row, strict=True))
        for row in zip(*(column.values for column in columns), strict=True)
    ]


def _key(name: str) -> str:
    return re.sub(r"[^\w.\[\]]+", "_", to_plain(name)).strip("_")


def in_words(chapter: Chapter, words: Callable[[str], str]) -> Chapter:
    """The chapter with its texts in the words of an outlet, such as hints that name options."""

    def cell(value: Any) -> Any:
        return words(value) if isinstance(value, str) else value

    def table(worded_table: Table) -> Table:
        worded = {
            name: dataclasses.replace(c, values=list(map(cell, c.values)))
            for name, c in worded_table.columns.items()
        }
        return dataclasses.replace(worded_table, columns=worded)

    return dataclasses.replace(
        chapter,
        summary=tuple(map(words, chapter.paragraphs)),
        tables=tuple(map(table, chapter.tables)),
        values=tuple(
            dataclasses.replace(named, value=cell(named.value)) for named in chapter.values
        ),
        problems=tuple(map(words, chapter.problems)),
        notes=tuple(map(words, chapter.notes)),
    )


def as_sheet(chapter: Chapter) -> dict[str, Any]:
    """The chapter as plain data: title, paragraphs, problems, notes, values and tables by name;
    numbers as texts.
    """
    return {
        "title": to_plain(chapter.title),
        "paragraphs": list(map(to_plain, chapter.paragraphs)),
        "problems": list(chapter.problems),
        "notes": list(map(to_plain, chapter.notes)),
        "values": [[named.name, value_text(named)] for named in chapter.values],
        "tables": {table.name: table_sheet(table) for table in chapter.tables if table.shown},
    }


def table_sheet(table: Table) -> dict[str, Any]:
    """A table as plain data: title, note, headings with whether their column is numeric, and rows
    of texts.
    """
    columns = shown_columns(table)
    cells = [[to_plain(column.cell_text(cell)) for cell in column.cells] for column in columns]
    return {
        "title": to_plain(table.title),
        "note": to_plain(table.note),
        "headings": [
            {"text": to_plain(column.heading), "number": column.is_numeric} for column in columns
        ],
        "rows": [list(row) for row in zip(*cells, strict=True)],
    }


def csv_text(table: Table) -> str:
    """A table as CSV: headers with units, numbers with all digits, an empty cell for NaN and
    infinity.
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    columns = shown_columns(table, chosen=False)
    writer.writerow([to_plain(column.heading) for column in columns])
    text = functools.cache(lambda cell: printable(to_plain(cell)))  # of many runs the same

    def cell(value: Any) -> Any:  # both ends of a range with `to` between them
        if isinstance(value, float):
            return value if math.isfinite(value) else None
        if isinstance(value, str):
            return text(value)
        if isinstance(value, tuple):
            return " to ".join(map(str, dict.fromkeys(value)))
        return int(value) if isinstance(value, bool) else value

    writer.writerows(zip(*(map(cell, column.cells) for column in columns), strict=True))
    return file.getvalue()
