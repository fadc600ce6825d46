"""Chapters for the page in the browser: texts and tables as they are shown, as plain data."""

from __future__ import annotations

import csv
import io
import math
from typing import Any

from ..core.errors import printable
from .chapter import Chapter, Table
from .formula import to_plain
from .shown import rows_of, shown_columns, value_text


def as_sheet(chapter: Chapter) -> dict[str, Any]:
    """The chapter as plain data: title, paragraphs, problems, notes, values and tables by name; numbers as texts."""
    return {
        "title": to_plain(chapter.title),
        "paragraphs": list(map(to_plain, chapter.paragraphs)),
        "problems": list(chapter.problems),
        "notes": list(map(to_plain, chapter.notes)),
        "values": [[named.name, value_text(named)] for named in chapter.values],
        "tables": {table.name: table_sheet(table) for table in chapter.tables if table.shown},
    }


def table_sheet(table: Table) -> dict[str, Any]:
    """A table as plain data: title, note, headings with whether their column is numeric, and rows of texts."""
    columns = shown_columns(table)
    cells = [[to_plain(each.cell_text(cell)) for cell in each.cells] for each in columns]
    return {
        "title": to_plain(table.title),
        "note": to_plain(table.note),
        "headings": [{"text": to_plain(each.heading), "number": each.is_numeric} for each in columns],
        "rows": [list(row) for row in zip(*cells, strict=True)],
    }


def csv_text(table: Table) -> str:
    """A table as CSV: headers with units, numbers with all digits, an empty cell for NaN and infinity."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    columns = shown_columns(table, chosen=False)
    writer.writerow([to_plain(each.heading) for each in columns])
    writer.writerows([_csv_value(value) for value in row] for row in rows_of(columns))
    return file.getvalue()


def _csv_value(value: Any) -> Any:
    """A cell of a CSV file; both ends of a range with `to` between them."""
    if isinstance(value, tuple):
        return " to ".join(map(str, dict.fromkeys(value)))
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str):
        return printable(to_plain(value))
    return None if isinstance(value, float) and not math.isfinite(value) else value
