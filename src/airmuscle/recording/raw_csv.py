"""Text tables as laboratories write them: from bytes to a RawTable, with nothing yet understood of its columns."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import ColumnError, FileError, UnitError
from ..units import conversion
from .heading import read_heading
from .table import Cells, RawTable

_COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_POINT_NUMBER = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
_REMARK = re.compile(r"[#%]\s*(?P<name>[A-Za-z_]\w*)(?:\s*\[(?P<unit>[^\]]*)\])?\s*[=:]\s*(?P<value>.+)")
_STATED_IN_WORDS = ("resting_length", "ambient", "specimen")

Lines = list[tuple[int, str]]
"""Lines of a file with their numbers, counted from 1."""


def raw_csv(path: str | Path) -> RawTable:
    """The table in a text file. Raises FileError or ColumnError."""
    path = Path(path)
    lines = [(i, line) for i, line in enumerate(re.split(r"\r\n|\n|\r", _text(path)), 1) if line.strip(' \t;,"')]
    comments = [(i, line) for i, line in lines if line.lstrip()[0] in "#%"]
    body = [(i, line) for i, line in lines if line.lstrip()[0] not in "#%"]
    if not body:
        raise FileError(f"{path.name}: the file holds no table. A table has a line of headings and rows of numbers.")
    delimiter = next((d for d in "\t;" if d in body[0][1]), ",")
    headings, body = _headings(path.name, comments, body, delimiter)
    units = _units(headings, body, delimiter)
    if units:
        body = body[1:]
    if not body:
        raise FileError(f"{path.name}: there are headings ({', '.join(headings)}) but no rows of numbers below them.")
    columns = _columns(path.name, headings, body, delimiter)
    rows = np.array([i for i, _ in body], dtype=np.int64)
    remarks = dict(found for _, line in comments if (found := _remark(line)))
    return RawTable(path.name, tuple(headings), units, columns, rows, remarks=remarks)


def _text(path: Path) -> str:
    try:
        content = path.read_bytes()
    except OSError as reason:
        raise FileError(f"{path}: cannot be read ({reason.strerror}). Check the name and the folder.") from None
    if not content.strip():
        raise FileError(f"{path}: the file is empty.")
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _headings(origin: str, comments: Lines, body: Lines, delimiter: str) -> tuple[list[str], Lines]:
    """The headings and the lines below them; they may stand in the last comment above the numbers."""
    first, cells = body[0][0], _cells(body[0][1], delimiter)
    if not all(_is_number(cell) for cell in cells if cell):
        return cells, body[1:]
    above = [_cells(line.lstrip("#% \t"), delimiter) for i, line in comments if i < first]
    if above and len(above[-1]) == len(cells) and not all(_is_number(cell) for cell in above[-1]):
        return above[-1], body
    raise ColumnError(
        f"{origin}, line {first}: numbers stand where the headings should. Put a line above them that names each "
        "column with its unit, like 'pressure [kPa], contraction [%], force [N]'."
    )


def _units(headings: Sequence[str], body: Lines, delimiter: str) -> tuple[str, ...] | None:
    """The row of units below the headings, if the first row is one: some unit in it, and no number but 1."""
    if not body:
        return None
    cells = [re.sub(r"^\[(.*)\]$|^\((.*)\)$", r"\1\2", cell) for cell in _cells(body[0][1], delimiter)]
    if any(_is_number(cell) and cell != "1" for cell in cells):
        return None
    telling = [pair for pair in zip(headings, cells, strict=False) if pair[1] not in ("", "1")]
    return tuple(cells) if any(_is_unit(text, cell) for text, cell in telling) else None


def _is_unit(heading: str, cell: str) -> bool:
    target = read_heading(heading).target
    try:
        return target is not None and bool(conversion(cell, target))
    except UnitError:
        return False


def _columns(origin: str, headings: list[str], body: Lines, delimiter: str) -> tuple[Cells, ...]:
    """The columns, by a fast parser where every cell is a number, otherwise cell by cell."""
    comma = delimiter != "," and any("," in line for _, line in body)
    lines = [line.replace(",", ".") if comma else line for _, line in body]
    try:
        numbers = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2, quotechar='"')
    except ValueError:
        numbers = np.empty((0, 0))  # a text, an empty cell or a ragged row: `_by_cells` says in which line
    doubtful = comma and any("." in line for _, line in body)
    if doubtful or numbers.shape != (len(body), len(headings)):
        return _by_cells(origin, headings, body, delimiter, comma)
    return tuple(np.ascontiguousarray(column) for column in numbers.T)


def _by_cells(origin: str, headings: list[str], body: Lines, delimiter: str, comma: bool) -> tuple[Cells, ...]:
    rows = [_cells(line, delimiter) for _, line in body]
    width = len(headings)
    for (line, _), row in zip(body, rows, strict=True):
        if len(row) < width or any(row[width:]):
            hint = " If the comma is a decimal comma, separate the columns by ';' or tab." if delimiter == "," else ""
            raise ColumnError(
                f"{origin}, line {line}: {len(row)} cells stand under {width} headings ({', '.join(headings)}).{hint} "
                "Lines that are no part of the table must begin with '#'."
            )
    if comma:
        _refuse_two_decimal_signs(origin, body, rows)
    return tuple(_parsed([row[i] for row in rows]) for i in range(width))


def _parsed(cells: list[str]) -> Cells:
    plain = [cell.replace(",", ".") if _COMMA_NUMBER.fullmatch(cell) else cell for cell in cells]
    try:
        return np.array([float(cell) for cell in plain])
    except ValueError:
        return plain


def _refuse_two_decimal_signs(origin: str, body: Lines, rows: list[list[str]]) -> None:
    """`1,234` beside `0.5` may be a thousand or a bit more than one: refuse to guess."""
    found: dict[str, tuple[int, str]] = {}
    for (line, _), row in zip(body, rows, strict=True):
        for cell in row:
            sign = "," if _COMMA_NUMBER.fullmatch(cell) else "." if _POINT_NUMBER.fullmatch(cell) else ""
            found.setdefault(sign, (line, cell))
    if "," in found and "." in found:
        (line, cell), (other, example) = found[","], found["."]
        raise ColumnError(
            f"{origin}, line {line}: is the comma in '{cell}' a decimal comma? Line {other} has a decimal point "
            f"('{example}'). Write all numbers with one decimal sign and without a sign for thousands."
        )


def _remark(line: str) -> tuple[str, float | str] | None:
    """`# resting_length [mm] = 300` or `# resting_length: 300 mm`; None for a comment that states no constant.

    Any number or quoted text in JSON is a constant of the run; plain words only where they are expected.
    """
    found = _REMARK.fullmatch(line.strip())
    if not found:
        return None
    name, said = found["name"], found["value"].strip()
    try:
        value = json.loads(said)
    except json.JSONDecodeError:
        return (name, said) if name in _STATED_IN_WORDS else None
    if not isinstance(value, float | int | str) or isinstance(value, bool):
        return None
    return name, f"{said} {found['unit']}" if found["unit"] else value
