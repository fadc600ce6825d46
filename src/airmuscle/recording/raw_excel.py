"""Excel workbooks: every worksheet that holds a table is one."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ColumnError, FileError, suggestion
from .header import are_headings, missing_header_error, parse_constant_comment, parse_unit_row
from .optional_dependency import run_reader, import_lab_package
from .table import Cells, RawTable

Rows = list[tuple[int, list[Any]]]
"""Rows of a worksheet with their numbers, counted from 1; no row is empty."""


def read_excel_tables(path: Path, sheet: str | None = None, *, headless: bool = False) -> tuple[RawTable, ...]:
    """A table for every worksheet that holds one, or for the one named. Raises FileError or ColumnError."""
    openpyxl = import_lab_package("openpyxl", path)

    def read() -> dict[str, Rows]:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        try:
            _check_sheet_exists(path, sheet, book.sheetnames)
            names = [w.title for w in book.worksheets] if sheet is None else [sheet]
            return {name: _nonempty_rows(book[name].iter_rows(values_only=True)) for name in names}
        finally:
            book.close()

    sheets = {name: rows for name, rows in run_reader(path, "an Excel workbook", read).items() if _contains_table(rows)}
    if not sheets:
        raise FileError(f"{path.name}: no worksheet holds a table. A table has a row of headings and rows of numbers.")
    several = len(sheets) > 1
    return tuple(
        _parse_table(f"{path.name}, sheet '{name}'" if several else path.name, rows, headless)
        for name, rows in sheets.items()
    )


def _check_sheet_exists(path: Path, sheet: str | None, names: list[str]) -> None:
    if sheet is not None and sheet not in names:
        raise FileError(f"{path.name}: no sheet '{sheet}'; there are {', '.join(names)}.{suggestion(sheet, names)}")


def _nonempty_rows(rows: Iterable[tuple[Any, ...]]) -> Rows:
    return [(i, list(row)) for i, row in enumerate(rows, 1) if any(cell not in (None, "") for cell in row)]


def _contains_table(rows: Rows) -> bool:
    return any(_is_numeric(row) for _, row in rows)


def _parse_table(origin: str, rows: Rows, headless: bool) -> RawTable:
    """The table of a worksheet; what stands above the headings counts as remarks."""
    start = _find_heading_row(rows)
    remarks = dict(found for _, row in rows[:start] if (found := _parse_constant(row)))
    first, cells = rows[start]
    used = [j for j, cell in enumerate(cells) if cell not in (None, "")]
    if are_headings([_text(c) for c in cells]):
        headings, body = [_text(cells[j]) for j in used], rows[start + 1 :]
    elif headless:
        headings, body = [str(n) for n in range(1, len(used) + 1)], rows[start:]
    else:
        raise missing_header_error(f"{origin}, row {first}")
    below = [_text(_cell(body[0][1], j)) for j in used] if body else []
    units = parse_unit_row(headings, below)
    body = body[1:] if units else body
    if not body:
        raise FileError(f"{origin}: there are headings ({', '.join(headings)}) but no rows of numbers below them.")
    _check_headings_cover(origin, headings, used, body)
    columns = tuple(_column([_cell(row, j) for _, row in body]) for j in used)
    return RawTable(origin, tuple(headings), units, columns, np.array([i for i, _ in body]), "row", remarks)


def _find_heading_row(rows: Rows) -> int:
    """The last row above the numbers that is as wide as they are; where it holds their units, the one above it."""
    numeric = next((i for i, (_, row) in enumerate(rows) if _is_numeric(row)), 0)
    width = sum(c not in (None, "") for c in rows[numeric][1])
    above = [i for i in range(numeric) if sum(c not in (None, "") for c in rows[i][1]) >= width]
    if not above:
        return numeric
    two = len(above) > 1 and above[-2] == above[-1] - 1
    last = [_text(c) for c in rows[above[-1]][1]]
    return above[-2] if two and parse_unit_row([_text(c) for c in rows[above[-2]][1]], last) else above[-1]


def _is_numeric(row: list[Any]) -> bool:
    """Whether a row belongs to the numbers: more than half of its cells do, beside texts like an operator's name."""
    cells = [c for c in row if c not in (None, "")]
    numbers = sum(isinstance(c, float | int | datetime.date | datetime.time) for c in cells)
    return 2 * numbers > len(cells)


def _parse_constant(row: list[Any]) -> tuple[str, float | str] | None:
    """`resting_length | 300 mm` in two cells, `resting_length | 300 | mm` in three, or a comment as in text files."""
    cells = [_text(c) for c in row if c not in (None, "")]
    head, rest = (cells[0].rstrip(" :="), " ".join(cells[1:])) if len(cells) > 1 else (cells[0], "")
    text = f"{head} = {rest}" if rest else head
    return parse_constant_comment(text if text[0] in "#%" else f"# {text}")


def _cell(row: list[Any], j: int) -> Any:
    return row[j] if j < len(row) else None


def _check_headings_cover(origin: str, headings: list[str], used: list[int], body: Rows) -> None:
    for i, row in body:
        outside = [j for j, cell in enumerate(row) if cell not in (None, "") and j not in used]
        if outside:
            raise ColumnError(
                f"{origin}, row {i}: '{_text(row[outside[0]])}' stands under no heading (there are "
                f"{', '.join(headings)}). Name its column, or move what is no part of the table elsewhere."
            )


def _text(cell: Any) -> str:
    if cell is None:
        return ""
    return cell.isoformat() if isinstance(cell, datetime.date | datetime.time) else str(cell).strip()


def _column(cells: list[Any]) -> Cells:
    if all(isinstance(cell, float | int) and not isinstance(cell, bool) for cell in cells):
        return np.array(cells, dtype=float)
    texts = [_text(cell) for cell in cells]
    try:
        return np.array([float(text) for text in texts])
    except ValueError:
        return texts
