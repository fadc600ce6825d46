"""Text table format: encoding, delimiter, decimal sign, headings and units."""

import codecs
import csv
import dataclasses
import re
from collections.abc import Mapping, Sequence

import numpy as np

from ....core import FileError, ParameterError, abridged
from . import header
from .channels import Cells, RawTable

MAX_HEADER_LINES = 10_000
"""Number of lines with content in which headings and first numbers are looked for (chosen: no data
logger writes as many above its table)."""
NumberedLines = list[tuple[int, str]]
"""Lines of a file with their numbers, counted from 1."""

_SIGNS = {
    "delimiter": (("\t", ";", ",", "|", " "), "a comma, semicolon, tab, blank or '|'"),
    "decimal": ((".", ","), "'.' or ','"),
}


@dataclasses.dataclass(frozen=True)
class TextFormat:
    """Format of a text table: `delimiter` and `decimal`; None means automatic detection.

    With `headerless`, the columns of a table without headings are named by their numbers, "1", "2"
    and so on. The headings are in the line that contains most of `named`, or in the first one below
    `skip_rows` lines if it is given.
    """

    delimiter: str | None = None
    decimal: str | None = None
    headerless: bool = False
    named: tuple[str, ...] = ()
    skip_rows: int | None = None

    def __post_init__(self) -> None:
        for name, (signs, text) in _SIGNS.items():
            sign = getattr(self, name)
            if sign is not None and sign not in signs:
                raise ParameterError(
                    f"{name} is {abridged(sign)}; it must be {text}. Omit it for automatic"
                    " detection."
                )
        if self.delimiter == self.decimal == ",":
            raise ParameterError(
                "delimiter and decimal are both ','; they must differ. Export the table with ';'."
            )

    def detect_delimiter(self, line: str) -> str:
        """The given delimiter, otherwise the one detected in a line of the table; blanks only
        between numbers.
        """
        sign = next((d for d in "\t;" if d in line), "|" if "|" in line and "," not in line else "")
        if self.delimiter or sign:
            return self.delimiter or sign
        cells = line.split()
        return (
            " "
            if len(cells) > 1 and all(header.is_number(c) and not c.endswith(",") for c in cells)
            else ","
        )


@dataclasses.dataclass(frozen=True)
class TextHeader:
    """Header of a text table: headings, unit row, constants in comments, and the delimiter."""

    headings: tuple[str, ...]
    units: tuple[str, ...] | None
    constants: Mapping[str, float | str]
    delimiter: str
    header_lines: int
    """Number of lines, without comments, above the numbers: headings, unit row, and lines above the
    headings.
    """
    above: tuple[str, ...] = ()
    """Cells of the line above the headings, for each of them; empty if there is none."""

    def table(
        self,
        origin: str,
        columns: tuple[Cells, ...],
        rows: Sequence[int],
        notes: tuple[str, ...] = (),
    ) -> RawTable:
        """The table of these columns, whose rows are the lines of these numbers."""
        lines = np.array(rows, dtype=np.int64)
        return RawTable(
            origin,
            self.headings,
            self.units,
            columns,
            lines,
            constants=self.constants,
            notes=notes,
            above=self.above,
        )


def detect_encoding(content: bytes) -> str:
    """The encoding of a file from its beginning: that of a byte order mark, UTF-8 if valid,
    otherwise Latin-1.
    """
    if content[:4] in (b"\xff\xfe\0\0", b"\0\0\xfe\xff"):
        return "utf-32"
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(
            content
        )  # a truncated last character is not an error
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


TERMINAL_BANNER = "=~=~=~="
"""Beginning of the line that a terminal program writes above its log."""
MIN_GRID = 2
"""Least number of columns of numbers of a grid (chosen)."""


def is_comment(line: str) -> bool:
    """Whether a line with content is a comment, or the banner of a terminal program."""
    return line.lstrip().startswith(("#", "%", TERMINAL_BANNER))


def has_content(line: str) -> bool:
    """Whether a line contains more than delimiters and blanks."""
    return bool(line.strip(' \t;,"\r\n'))


def split_cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line; a blank before a unit in brackets, `time [s] force [N]`, does not
    separate cells.
    """
    if delimiter == " " and '"' not in line:
        return re.split(r"(?<=[\])])\s+|\s+(?![\[(])", line.strip())
    return [
        cell.strip()
        for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    ]


def check_cell_sizes(origin: str, lines: NumberedLines) -> None:
    """Raise FileError for a cell with more characters than the parser of the cells takes."""
    limit = csv.field_size_limit()
    for i, line in lines:
        if len(line) > limit and max(map(len, re.split("[\t;,| ]", line))) > limit:
            raise FileError(
                f"{origin}, line {i}: a cell has more than {limit} characters. It is no table of"
                " numbers."
            )


def _with_blanks(text_format: TextFormat, body: NumberedLines) -> TextFormat:
    """The format with the delimiter blank, if blanks separate the first numbers."""
    for _, line in body:
        delimiter = text_format.detect_delimiter(line)
        if delimiter == " ":
            text_format = dataclasses.replace(text_format, delimiter=delimiter)
        if delimiter != "," or _is_numeric(split_cells(line, delimiter)):
            break
    return text_format


def parse_header(origin: str, lines: NumberedLines, text_format: TextFormat) -> TextHeader:
    """Parse the header of a table from its first non-empty lines. Raises FileError or
    ColumnError.
    """
    check_cell_sizes(origin, lines)
    comments = [(i, line) for i, line in lines if is_comment(line)]
    body = [(i, line) for i, line in lines if not is_comment(line)]
    if not body:
        raise FileError(
            f"{origin}: the file contains no table. A table consists of a row of headings and rows"
            " of numbers."
        )
    beginning = body[: MAX_HEADER_LINES + (text_format.skip_rows or 0)]
    if text_format.delimiter is None:
        text_format = _with_blanks(text_format, beginning)
    above = _lines_above_headings(beginning, text_format)
    if text_format.skip_rows is not None and body[-1][0] <= text_format.skip_rows:
        raise FileError(
            f"{origin}: there is no table below the {text_format.skip_rows} lines of skip_rows."
        )
    preamble = body[:above]
    body = body[above:]
    delimiter = text_format.detect_delimiter(body[0][1])
    first = body[0][0]
    commented = [line.lstrip("#% \t") for i, line in comments if i < first]
    rows = [split_cells(line, delimiter) for _, line in body[:3]]
    last = split_cells(commented[-1], delimiter) if commented else ()
    headings, units, count = header.parse_headings(
        origin, f"line {first}", rows, text_format.headerless, last
    )
    constants = [header.parse_constant_cells(split_cells(line, delimiter)) for _, line in preamble]
    constants += [header.parse_constant_comment(line) for _, line in comments]
    return TextHeader(
        tuple(headings),
        units,
        dict(filter(None, constants)),
        delimiter,
        above + count,
        _cells_above(preamble, delimiter, len(headings)),
    )


def _cells_above(preamble: NumberedLines, delimiter: str, width: int) -> tuple[str, ...]:
    """The cells of the line above the headings, one for each; empty where there is none."""
    if not preamble:
        return ()
    cells = split_cells(preamble[-1][1], delimiter)
    return tuple([*cells, *[""] * width][:width]) if len(cells) > 1 else ()


def _lines_above_headings(body: NumberedLines, text_format: TextFormat) -> int:
    """The number of lines above the headings, which are where the user states them, else the line
    of as many cells above the first numbers or unit row."""
    cells_of = ((i, split_cells(line, text_format.detect_delimiter(line))) for i, line in body)
    stated = header.stated_heading_row(cells_of, text_format.named, text_format.skip_rows)
    if stated is not None:
        return stated
    rows: list[tuple[str, list[str]]] = []
    for index, (_, line) in enumerate(body):
        delimiter = text_format.detect_delimiter(line)
        cells = split_cells(line, delimiter)
        if _is_grid_heading(
            cells, [split_cells(row, delimiter) for _, row in body[index + 1 : index + 3]]
        ):
            return index
        if _is_numeric(cells):
            before = rows[-1][1] if rows else []
            if not rows or (
                _is_numeric(before) and header.is_number(cells[0]) and header.is_number(before[0])
            ):
                return 0  # no heading is found above the first rows of numbers
            above = _heading_above(rows, delimiter, header.count_cells(cells))
            if above is not None:
                return above
        rows.append((delimiter, cells))
    return 0


def _heading_above(rows: list[tuple[str, list[str]]], delimiter: str, width: int) -> int | None:
    """The index of the headings of a first row of numbers with `width` filled cells; None if they
    are not above it.
    """
    last = [cells for sign, cells in rows[-2:] if sign == delimiter]
    if not last or rows[-1][0] != delimiter or _is_numeric(last[-1]):
        return None
    if len(last) == 2 and header.parse_unit_row(last[0], last[1]):
        widest = max(map(header.count_cells, last))
        return len(rows) - 2 if widest >= width else None
    return len(rows) - 1 if header.count_cells(last[-1]) >= width else None


def _is_grid_heading(cells: list[str], below: list[list[str]]) -> bool:
    """Whether cells are the headings of a grid: a text or an empty corner and rising numbers, above
    rows of numbers alone.
    """
    first = cells[0]
    numbers = [cell.replace(",", ".") for cell in cells[1:]]
    if len(numbers) < MIN_GRID or not below:
        return False
    if header.is_number(first) or (first and not any(map(str.isalpha, first))):
        return False
    if not all(map(header.is_number, numbers)):
        return False
    values = [float(number) for number in numbers]
    steps = np.diff(values)
    if not (np.all(steps > 0) or np.all(steps < 0)):
        return False
    return all(len(row) == len(cells) and _is_grid_row(row) for row in below)


def _is_grid_row(cells: list[str]) -> bool:
    """Whether cells are a number, and numbers or empty cells."""
    return bool(cells[0]) and all(header.is_number(cell) for cell in cells if cell)


def _is_numeric(cells: list[str]) -> bool:
    """Whether a row has two cells or more, and more than half of them are numbers, clock times or
    dates.
    """
    filled = [cell for cell in cells if cell]
    numbers = sum(header.is_number(cell) or not any(map(str.isalpha, cell)) for cell in filled)
    return len(filled) > 1 and 2 * numbers > len(filled)
