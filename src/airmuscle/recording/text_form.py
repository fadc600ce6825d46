"""In which form a text table is written: encoding, delimiter, decimal sign, headings and units."""

from __future__ import annotations

import codecs
import csv
import dataclasses
from collections.abc import Mapping

from ..core.errors import FileError, ParameterError
from .header import are_headings, check_header, remark, unit_row

Lines = list[tuple[int, str]]
"""Lines of a file with their numbers, counted from 1."""

_DELIMITERS = ("\t", ";", ",", "|", " ")
_DECIMALS = (".", ",")


@dataclasses.dataclass(frozen=True)
class TextForm:
    """What the reader of a text table must know, or may be told: `delimiter`, `decimal`; None is found out.

    With `headless` the columns are named by their numbers, "1", "2" and so on, where no headings stand.
    """

    delimiter: str | None = None
    decimal: str | None = None
    headless: bool = False

    def __post_init__(self) -> None:
        if self.delimiter is not None and self.delimiter not in _DELIMITERS:
            raise ParameterError(
                f"delimiter is {self.delimiter!r}; it must be a comma, semicolon, tab, blank or '|'. Leave it out to "
                "have it recognised."
            )
        if self.decimal is not None and self.decimal not in _DECIMALS:
            raise ParameterError(f"decimal is {self.decimal!r}; it must be '.' or ','. Leave it out for either.")
        if self.delimiter == self.decimal == ",":
            raise ParameterError("delimiter and decimal are both ','; no table can be read so. Export it with ';'.")

    def delimiter_of(self, line: str) -> str:
        """The delimiter: the one told, or else what this first line holds."""
        return self.delimiter or next((d for d in "\t;" if d in line), ",")


@dataclasses.dataclass(frozen=True)
class TextHeader:
    """What stands above the numbers: headings, a row of units, remarks; and how cells are told apart."""

    headings: tuple[str, ...]
    units: tuple[str, ...] | None
    remarks: Mapping[str, float | str]
    delimiter: str
    rows_above: int
    """How many lines of the table itself are no rows of numbers: 0, 1 or 2."""


def encoding_of(content: bytes) -> str:
    """The encoding that the beginning of a file shows: UTF-16 by its mark, UTF-8 where it decodes, else Latin-1."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(content)  # a character cut in two at the end is no error
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def is_comment(line: str) -> bool:
    """Whether a line is a comment; only for lines that hold something."""
    return line.lstrip().startswith(("#", "%"))


def holds_something(line: str) -> bool:
    """Whether a line holds more than delimiters and blanks."""
    return bool(line.strip(' \t;,"\r\n'))


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


def head_of(origin: str, lines: Lines, form: TextForm) -> TextHeader:
    """The head of a table from its first lines, none of them empty. Raises FileError or ColumnError."""
    comments = [(i, line) for i, line in lines if is_comment(line)]
    body = [(i, line) for i, line in lines if not is_comment(line)]
    if not body:
        raise FileError(f"{origin}: the file holds no table. A table has a line of headings and rows of numbers.")
    delimiter = form.delimiter_of(body[0][1])
    headings, above = _headings(origin, comments, body, delimiter, form.headless)
    below = cells_of(body[above][1], delimiter) if len(body) > above else []
    units = unit_row(headings, below)
    above += 1 if units else 0
    if len(body) <= above:
        raise FileError(f"{origin}: there are headings ({', '.join(headings)}) but no rows of numbers below them.")
    remarks = dict(found for _, line in comments if (found := remark(line)))
    return TextHeader(tuple(headings), units, remarks, delimiter, above)


def _headings(origin: str, comments: Lines, body: Lines, delimiter: str, headless: bool) -> tuple[list[str], int]:
    """The headings, and how many lines of the body they take; they may stand in the last comment above it."""
    first, cells = body[0][0], cells_of(body[0][1], delimiter)
    if are_headings(cells):
        return cells, 1
    above = [cells_of(line.lstrip("#% \t"), delimiter) for i, line in comments if i < first]
    if above and len(above[-1]) == len(cells) and are_headings(above[-1]):
        return above[-1], 0
    if headless:
        return [str(i) for i in range(1, len(cells) + 1)], 0
    raise check_header(f"{origin}, line {first}")
