"""Reader of workbooks (.xlsx, .xlsm, .xls, .ods): one table for each worksheet that contains
one.
"""

import datetime
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....core import ColumnError, FileError, check_known, listed
from ..tables import (
    Cells,
    RawTable,
    Selection,
    TextFormat,
    header,
    import_lab_package,
    numbers_if_all,
    reading,
    seconds_from_clock,
)

_EMPTY = (None, "")
_NUMBERS = float | int | datetime.date | datetime.time | datetime.timedelta
Rows = list[tuple[int, list[Any]]]
"""Non-empty rows of a worksheet with their numbers, counted from 1."""


def read_workbook_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read one table from each worksheet that contains one, or from the named worksheet.

    Delimiter and decimal sign of the text format do not apply.
    Of a formula, its stored value is read; a cell with an error is empty, and chart sheets have no
    cells. Raises FileError or ColumnError.
    """
    calamine = import_lab_package("python_calamine", path)
    with reading(path, "a workbook"), calamine.CalamineWorkbook.from_path(str(path)) as book:
        names = [
            sheet.name
            for sheet in book.sheets_metadata
            if sheet.typ == calamine.SheetTypeEnum.WorkSheet
        ]
        check_known(
            f"{path.name}: no sheet",
            [] if selection.sheet is None else selection.sheet,
            names,
            "the sheets are",
            FileError,
        )
        cells = {
            name: book.get_sheet_by_name(name).to_python(skip_empty_area=False)
            for name in names
            if selection.sheet in (None, name)
        }
    filled_rows = {
        name: [(i, row) for i, row in enumerate(rows, 1) if header.count_cells(row)]
        for name, rows in cells.items()
    }
    sheets = {
        name: rows for name, rows in filled_rows.items() if any(_is_numeric(row) for _, row in rows)
    }
    if not sheets:
        raise FileError(
            f"{path.name}: no worksheet contains a table. A table consists of a row of headings and"
            " rows of numbers."
        )
    origins = [f"{path.name}, sheet '{name}'" if len(sheets) > 1 else path.name for name in sheets]
    return tuple(
        _parse_table(*part, selection.text_format)
        for part in zip(origins, sheets.values(), strict=True)
    )


def _parse_table(origin: str, rows: Rows, text_format: TextFormat) -> RawTable:
    """The table of a worksheet; rows above the headings may state constants."""
    texts = ((i, _texts(row)) for i, row in rows)
    stated = header.stated_heading_row(texts, text_format.named, text_format.skip_rows)
    if text_format.skip_rows is not None and stated is None:
        raise FileError(
            f"{origin}: there is no table below the {text_format.skip_rows} rows of skip_rows."
        )
    start = _heading_row(rows) if stated is None else stated
    constants = [header.parse_constant_cells(_texts(row)) for _, row in rows[:start]]
    first, cells = rows[start]
    used = [j for j, cell in enumerate(cells) if cell not in _EMPTY]
    beginning = [[_text(row[j]) for j in used] for _, row in rows[start : start + 3]]
    headings, units, count = header.parse_headings(
        origin, f"row {first}", beginning, text_format.headerless
    )
    body = rows[start + count :]
    _check_cells_below_headings(origin, body, used, headings)
    columns = tuple(_column([row[j] for _, row in body]) for j in used)
    numbers = tuple(j + 1 for j in used)
    if headings == [str(i) for i in range(1, len(used) + 1)]:  # of a table without headings
        headings = list(map(str, numbers))
    return RawTable(
        origin,
        tuple(headings),
        units,
        columns,
        np.array([i for i, _ in body]),
        "row",
        dict(filter(None, constants)),
        numbers=numbers,
    )


def _heading_row(rows: Rows) -> int:
    """The index of the headings: the last row above the numbers that is as wide as they are, or the
    row above the unit row.
    """
    numeric = next((i for i, (_, row) in enumerate(rows) if _is_numeric(row)), 0)
    width = header.count_cells(rows[numeric][1])
    above = [i for i in range(numeric) if header.count_cells(rows[i][1]) >= width]
    if not above:
        return numeric
    last = above[-1]
    if last - 1 in above and header.parse_unit_row(
        _texts(rows[last - 1][1]), _texts(rows[last][1])
    ):
        return last - 1
    return last


def _check_cells_below_headings(
    origin: str, body: Rows, used: Sequence[int], headings: Sequence[str]
) -> None:
    """Raise ColumnError where a row has a cell in a column without a heading."""
    for number, row in body:
        for j, cell in enumerate(row):
            if cell in _EMPTY or j in used:
                continue
            raise ColumnError(
                f"{origin}, row {number}: the cell '{_text(cell)}' has no heading (the headings are"
                f" {listed(headings)}). Add a heading to its column, or move the cell outside the"
                " rows of the table."
            )


def _is_numeric(row: list[Any]) -> bool:
    """Whether more than half of the cells of a row are numbers or times, also as texts; the others
    may be names.
    """
    cells = [cell for cell in row if cell not in _EMPTY]
    numbers = 0
    for cell in cells:
        if isinstance(cell, str):
            numbers += header.is_number(cell) or seconds_from_clock((cell,)) is not None
        else:
            numbers += isinstance(cell, _NUMBERS)
    return 2 * numbers > len(cells)


def _text(cell: Any) -> str:
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15:
        return str(int(cell))  # as it is shown
    if isinstance(cell, datetime.date | datetime.time):
        return cell.isoformat()
    return "" if cell is None else str(cell).strip()


def _texts(cells: list[Any]) -> list[str]:
    return [_text(cell) for cell in cells]


def _column(cells: list[Any]) -> Cells:
    """A column of numbers, also of numbers that are stored as texts with one decimal sign;
    otherwise of texts.
    """
    if all(isinstance(cell, float | int) and not isinstance(cell, bool) for cell in cells):
        return np.array(cells, dtype=float)
    texts = _texts(cells)
    stored = [cell for cell in cells if isinstance(cell, str)]
    if not any(header.POINT_NUMBER.fullmatch(text.strip()) for text in stored):
        texts = [
            text.replace(",", ".") if header.COMMA_NUMBER.fullmatch(text) else text
            for text in texts
        ]
    return numbers_if_all(texts)
