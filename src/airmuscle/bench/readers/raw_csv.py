"""Reader of text tables: from bytes to an uninterpreted RawTable."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...core.annotation import abridged
from ...core.errors import ColumnError, FileError, Hint
from ...recording.recording import list_rows
from .file_kind import check_text_file
from .header import COMMA_NUMBER, POINT_NUMBER
from .missing_cells import MAX_LISTED
from .table import Cells, RawTable
from .text_format import (
    NumberedLines,
    TextFormat,
    TextHeader,
    detect_encoding,
    has_content,
    is_comment,
    parse_header,
    split_cells,
)

_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")


def read_csv_table(path: str | Path, text_format: TextFormat = TextFormat()) -> RawTable:
    """Read the table in a text file. Raises FileError or ColumnError."""
    if not isinstance(path, str | Path):
        raise FileError(f"read_csv: {abridged(path)} is not a path. Pass the name of a file.")
    path = Path(path)
    check_text_file(path)
    return parse_text(path.name, _read_text(path), text_format)


def parse_text(origin: str, text: str, text_format: TextFormat) -> RawTable:
    """The table in a text. Raises FileError or ColumnError."""
    lines = [(i, line) for i, line in enumerate(re.split(r"\r\n|\n|\r", text), 1) if has_content(line)]
    header = parse_header(origin, lines, text_format)
    body = [(i, line) for i, line in lines if not is_comment(line)][header.header_lines :]
    columns = parse_columns(origin, header, body, text_format)
    rows = np.array([i for i, _ in body], dtype=np.int64)
    return RawTable(origin, header.headings, header.units, columns, rows, constants=header.constants)


def _read_text(path: Path) -> str:
    try:
        content = path.read_bytes()
    except OSError as reason:
        raise FileError(f"{path}: cannot be read ({reason.strerror}). Check the name and the folder.") from None
    if not content.strip():
        raise FileError(f"{path}: the file is empty.")
    return content.decode(detect_encoding(content), errors="replace")


def parse_columns(origin: str, header: TextHeader, body: NumberedLines, text_format: TextFormat) -> tuple[Cells, ...]:
    """The columns, from a fast parser if every cell is a number, otherwise cell by cell. Raises ColumnError."""
    comma = text_format.decimal != "." and header.delimiter != "," and any("," in line for _, line in body)
    lines = [line.replace(",", ".") if comma else line for _, line in body]
    separator = None if header.delimiter == " " else header.delimiter
    try:
        numbers = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2, quotechar='"')
    except ValueError:
        numbers = np.empty((0, 0))  # a text, an empty cell or a ragged row: `_parse_by_cell` reports the line
    ambiguous = (comma or text_format.decimal == ",") and any("." in line for _, line in body)
    if ambiguous or numbers.shape != (len(body), len(header.headings)):
        return _parse_by_cell(origin, header, body, text_format.decimal)
    return tuple(np.ascontiguousarray(column) for column in numbers.T)


def _parse_by_cell(origin: str, header: TextHeader, body: NumberedLines, decimal: str | None) -> tuple[Cells, ...]:
    rows = [split_cells(line, header.delimiter) for _, line in body]
    width = len(header.headings)
    for (line, _), row in zip(body, rows, strict=True):
        if len(row) < width or any(row[width:]):
            hint = " If the comma is a decimal comma, separate the columns by ';' or tab."
            raise ColumnError(
                f"{origin}, line {line}: the line must have {width} cells ({', '.join(header.headings)}); it has "
                f"{len(row)}."
                f"{hint if header.delimiter == ',' else ''} Start lines that are not part of the table with '#'."
            )
    if decimal is None:
        _check_decimal_sign(origin, body, rows)
    else:
        _check_thousands(origin, body, rows, decimal)
    return tuple(_to_cells([_with_decimal_point(row[i], decimal) for row in rows]) for i in range(width))


def _with_decimal_point(cell: str, decimal: str | None) -> str:
    """A number with a decimal point; if the decimal sign is given, the other sign separates thousands."""
    if decimal is None:
        return cell.replace(",", ".") if COMMA_NUMBER.fullmatch(cell) else cell
    thousands = "." if decimal == "," else ","
    plain = cell.replace(thousands, "").replace(",", ".")
    return plain if re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?", plain) else cell


def _to_cells(cells: list[str]) -> Cells:
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return cells


def _check_thousands(origin: str, body: NumberedLines, rows: list[list[str]], decimal: str) -> None:
    """Raise ColumnError where the sign that is not the stated decimal sign cannot separate thousands, as in `0.5`."""
    other = COMMA_NUMBER if decimal == "." else POINT_NUMBER
    wrong = [(i, cell) for i, cell in _cells(body, rows) if other.fullmatch(cell) and not _THOUSANDS.fullmatch(cell)]
    if wrong:
        line, cell = wrong[0]
        raise ColumnError(
            f"{origin}, line {line}: '{cell}' contradicts the decimal sign '{decimal}', which is stated: the other "
            f"sign separates groups of three digits{_further(wrong)}. Correct the decimal sign or the numbers."
        )


def _check_decimal_sign(origin: str, body: NumberedLines, rows: list[list[str]]) -> None:
    """Raise ColumnError if both signs occur: next to `0.5`, the comma in `1,234` may separate thousands."""
    commas = [(i, cell) for i, cell in _cells(body, rows) if COMMA_NUMBER.fullmatch(cell)]
    point = next(((i, cell) for i, cell in _cells(body, rows) if POINT_NUMBER.fullmatch(cell)), None)
    if commas and point is not None:
        (line, cell), (other, example) = commas[0], point
        raise ColumnError(
            f"{origin}, line {line}: the comma in '{cell}' is ambiguous, because line {other} contains a decimal point "
            f"('{example}'){_further(commas)}. Write all numbers with the same decimal sign and without thousands "
            "separators.",
            hint=Hint("To specify the decimal sign", "decimal", ",", function="ColumnMapping"),
        )


def _cells(body: NumberedLines, rows: list[list[str]]) -> Iterator[tuple[int, str]]:
    """All cells with the numbers of their lines."""
    return ((line, cell) for (line, _), row in zip(body, rows, strict=True) for cell in row)


def _further(cells: list[tuple[int, str]]) -> str:
    """The number of all such cells and their first lines; empty for one."""
    lines = list(dict.fromkeys(line for line, _ in cells))
    return f"; there are {len(cells)} such cells ({list_rows('line', lines, MAX_LISTED)})" if len(cells) > 1 else ""
