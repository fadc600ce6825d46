"""Text tables as laboratories write them: from bytes to a RawTable, with nothing yet understood of its columns."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..core.errors import ColumnError, FileError
from .table import Cells, RawTable
from .text_format import (
    NumberedLines,
    TextFormat,
    TextHeader,
    split_cells,
    detect_encoding,
    parse_header,
    has_content,
    is_comment,
)

_COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_POINT_NUMBER = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")


def read_csv_table(path: str | Path, form: TextFormat = TextFormat()) -> RawTable:
    """The table in a text file. Raises FileError or ColumnError."""
    if not isinstance(path, str | Path):
        raise FileError(f"read_csv: {path!r} is no path; name a file.")
    path = Path(path)
    lines = [(i, line) for i, line in enumerate(re.split(r"\r\n|\n|\r", _read_text(path)), 1) if has_content(line)]
    head = parse_header(path.name, lines, form)
    body = [(i, line) for i, line in lines if not is_comment(line)][head.header_lines :]
    columns = parse_columns(path.name, head, body, form)
    rows = np.array([i for i, _ in body], dtype=np.int64)
    return RawTable(path.name, head.headings, head.units, columns, rows, constants=head.constants)


def _read_text(path: Path) -> str:
    try:
        content = path.read_bytes()
    except OSError as reason:
        raise FileError(f"{path}: cannot be read ({reason.strerror}). Check the name and the folder.") from None
    if not content.strip():
        raise FileError(f"{path}: the file is empty.")
    return content.decode(detect_encoding(content), errors="replace")


def parse_columns(origin: str, head: TextHeader, body: NumberedLines, form: TextFormat) -> tuple[Cells, ...]:
    """The columns, by a fast parser where every cell is a number, otherwise cell by cell."""
    comma = form.decimal != "." and head.delimiter != "," and any("," in line for _, line in body)
    lines = [line.replace(",", ".") if comma else line for _, line in body]
    separator = None if head.delimiter == " " else head.delimiter
    try:
        numbers = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2, quotechar='"')
    except ValueError:
        numbers = np.empty((0, 0))  # a text, an empty cell or a ragged row: `_by_cells` says in which line
    doubtful = comma and any("." in line for _, line in body)
    if doubtful or numbers.shape != (len(body), len(head.headings)):
        return _parse_by_cell(origin, head, body, comma, form.decimal)
    return tuple(np.ascontiguousarray(column) for column in numbers.T)


def _parse_by_cell(
    origin: str, head: TextHeader, body: NumberedLines, comma: bool, decimal: str | None
) -> tuple[Cells, ...]:
    rows = [split_cells(line, head.delimiter) for _, line in body]
    width = len(head.headings)
    for (line, _), row in zip(body, rows, strict=True):
        if len(row) < width or any(row[width:]):
            hint = (
                " If the comma is a decimal comma, separate the columns by ';' or tab." if head.delimiter == "," else ""
            )
            raise ColumnError(
                f"{origin}, line {line}: {len(row)} cells stand under {width} headings ({', '.join(head.headings)})."
                f"{hint} Lines that are no part of the table must begin with '#'."
            )
    if comma and decimal is None:
        _check_decimal_sign(origin, body, rows)
    return tuple(_to_cells([_with_decimal_point(row[i], decimal) for row in rows]) for i in range(width))


def _with_decimal_point(cell: str, decimal: str | None) -> str:
    """A number with a decimal point; where the decimal sign was told, the other one parts thousands."""
    if decimal is None:
        return cell.replace(",", ".") if _COMMA_NUMBER.fullmatch(cell) else cell
    thousands = "." if decimal == "," else ","
    plain = cell.replace(thousands, "").replace(",", ".")
    return plain if re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?", plain) else cell


def _to_cells(cells: list[str]) -> Cells:
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return cells


def _check_decimal_sign(origin: str, body: NumberedLines, rows: list[list[str]]) -> None:
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
            f"('{example}'). Write all numbers with one decimal sign and without a sign for thousands, or say which "
            "one it is: decimal=','."
        )
