"""Follower of a growing table: rows of a file, a pipe or a serial log as they arrive, in SI
units.
"""

import csv
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from ...core import (
    AMBIENT_PRESSURE,
    ColumnError,
    FileError,
    ParameterError,
    UnitConversion,
    abridged,
    listed,
)
from ...recording.columns import displacement_columns, find_quantity_name
from .interpret import interpret, resolve_headings, unit_conversion
from .mapping import ColumnMapping
from .plausibility import CONTRACTION_RANGE, MAX_MAGNITUDE
from .tables import (
    RawTable,
    TextFormat,
    TextHeader,
    has_content,
    is_comment,
    is_number,
    parse_header,
    readable,
    split_cells,
)

MAX_UNREADABLE = 100
MAX_HEADER_LINES = 1000
MAX_LINE = 65536
"""Unreadable rows in succession, lines before the first numbers, and characters of a line that are
refused (chosen).
"""


class RowReader:
    """Reader of one row at a time: the header first, then each row of numbers as quantities in SI
    units.

    mapping  columns, units, constants and `skip_rows` of the stream; nothing else of a mapping
             applies to one
    fields   fields of the mapping, as in `read`

    `skipped` counts rows that could not be read, such as damaged lines. `notes` are those of
    `read_csv` on units.
    """

    def __init__(
        self, origin: str, mapping: ColumnMapping = ColumnMapping(), **fields: Any
    ) -> None:
        if not isinstance(mapping, ColumnMapping):
            raise ParameterError(
                f"RowReader: mapping must be a ColumnMapping; it is {abridged(mapping)}."
            )
        self.origin = origin
        self.mapping = mapping.with_fields(fields)
        self.skipped = 0
        self.notes: tuple[str, ...] = ()
        self._names = {str(key): heading for key, heading in mapping.columns.items()}
        self._head: list[tuple[int, str]] = []
        self._conversions: list[tuple[int, str, UnitConversion]] | None = None
        self._line = self._unreadable = 0

    def read(self, line: str) -> dict[str, float] | None:
        """The quantities of a line [SI]; None for a line of the header, a comment, or a row that
        cannot be read. Raises ColumnError, FileError or UnitError for a header without known
        quantities, or too many unreadable rows.
        """
        self._line += 1
        if not has_content(line) or self._line <= (self.mapping.skip_rows or 0):
            return None
        if self._conversions is None:
            return self._read_header(line.strip("\r\n").replace("\r", " "))
        return None if is_comment(line) else self._read_row(line)

    def _read_header(self, line: str) -> dict[str, float] | None:
        self._head.append((self._line, line))
        if len(self._head) > MAX_HEADER_LINES:
            raise FileError(
                f"{self.origin}: no row of numbers in the first {MAX_HEADER_LINES} lines."
            )
        text_format = TextFormat(headerless=bool(self._names))
        place = f"{self.origin}, line {self._line}"
        delimiter = text_format.detect_delimiter(line)
        cells = split_cells(line, delimiter)
        while cells and not cells[-1]:
            cells.pop()  # a delimiter at the end of the line
        if is_comment(line) or not cells or not all(is_number(cell) for cell in cells):
            return None
        header = parse_header(self.origin, self._head, text_format)
        if header.delimiter != delimiter and len(cells) > 1:
            signs = f"{delimiter!r}, the headings by {header.delimiter!r}"
            raise ColumnError(
                f"{place}: the numbers are separated by {signs}. Separate both alike."
            )
        self._delimiter = header.delimiter
        self._comma = header.delimiter != ","
        first = [float(self._point(cell)) for cell in cells]
        headings = self._mapped_headings(header.headings, len(first))
        if len(headings) != len(first):
            raise ColumnError(
                f"{place}: the line must have {len(headings)} cells ({listed(headings)}); it has"
                f" {len(first)}."
            )
        self._prepare(header, headings, first)
        return self._read_row(line)

    def _mapped_headings(self, texts: Sequence[str], width: int) -> tuple[str, ...]:
        """The headings as the mapping names them, by heading or number, without empty ones beyond
        the cells of a row. Raises ColumnError where the table lacks a mapped column.
        """
        numbers = [str(number) for number in range(1, width + 1)]
        for name in self._names:
            if name not in texts and name not in numbers:
                raise ColumnError(
                    f"{self.origin}: there is no column '{name}'; the columns are {listed(texts)}."
                )
        headings = tuple(
            self._names.get(text, self._names.get(str(number), text))
            for number, text in enumerate(texts, 1)
        )
        return headings if any(headings[width:]) else headings[:width]

    def _prepare(
        self, header: TextHeader, headings: tuple[str, ...], first: Sequence[float]
    ) -> None:
        """Interpret the first row, and keep the conversions for the rows after it."""
        columns = tuple(np.array([value]) for value in first)
        rows = np.array([self._line], dtype=np.int64)
        table = RawTable(
            self.origin, headings, header.units, columns, rows, constants=header.constants
        )
        recording = interpret(table, self.mapping)  # which checks the first row
        self._first = recording
        self.notes = recording.notes
        self._ambient = ambient = float(recording.constants.get("ambient", AMBIENT_PRESSURE))
        stated_names = {find_quantity_name(name) for name in self.mapping.constants}
        self._held = {name: float(recording[name][0]) for name in recording if name in stated_names}
        self._width = len(headings)
        self._conversions = [
            (i, heading.name, unit_conversion(table, heading, ambient))
            for i, heading in enumerate(resolve_headings(table, self.mapping.units))
            if heading.known
        ]

    def _read_row(self, line: str) -> dict[str, float] | None:
        try:
            cells = split_cells(line, self._delimiter)
            if len(cells) < self._width or any(cells[self._width :]):
                raise ValueError
            values = [float(self._point(cell)) for cell in cells[: self._width]]
            assert self._conversions is not None
            row = {
                **self._held,
                **{name: float(convert(values[i])) for i, name, convert in self._conversions},
            }
            for name, value in row.items():  # a damaged number may still be a number
                ranges = {
                    "pressure": (-self._ambient, MAX_MAGNITUDE),
                    "contraction": CONTRACTION_RANGE,
                }
                low, high = ranges.get(name.rpartition(".")[2], (-MAX_MAGNITUDE, MAX_MAGNITUDE))
                if not low < value < high:
                    raise ValueError
        except (ValueError, csv.Error):  # such as a carriage return within the line
            self.skipped = self.skipped + 1
            self._unreadable = self._unreadable + 1
            if self._unreadable > MAX_UNREADABLE:
                raise ColumnError(
                    f"{self.origin}, line {self._line}: {MAX_UNREADABLE} successive lines are no"
                    f" rows of {self._width} numbers. Check the baud rate and the format of the"
                    " stream."
                ) from None
            return None
        self._unreadable = 0
        row, _ = displacement_columns(row, self._first.constants)
        length = self._first.constants.get("resting_length")
        if "contraction" not in row and "length" in row and isinstance(length, float):
            row["contraction"] = (length - row["length"]) / length
        return row

    def _point(self, cell: str) -> str:
        return cell.replace(",", ".") if self._comma else cell


def follow_lines(
    source: str | Path | TextIO,
    *,
    idle: float,
    poll: float = 0.005,
    clock: Callable[[], float] = time.monotonic,
    pause: Callable[[float], Any] = time.sleep,
) -> Iterator[str]:
    """Complete lines of a growing file, or of an open stream, until nothing has arrived for `idle`
    seconds.

    A line without its end is held back until the rest of it comes, or until the end. A stream that
    is closed, such as a pipe, ends at once. Raises FileError if the file cannot be opened, or for a
    line of more than 65 536 characters.
    """
    if not isinstance(source, str | Path):
        yield from source
        return
    with (
        readable(source),
        Path(source).open(encoding="utf-8", errors="replace", newline="") as file,
    ):
        partial = ""
        last = clock()
        while True:
            line = file.readline(MAX_LINE)
            if not line:
                if clock() - last >= idle:
                    break
                pause(poll)
                continue
            partial = partial + line
            last = clock()
            if len(partial) >= MAX_LINE:
                raise FileError(
                    f"{source}: a line has more than {MAX_LINE} characters. It is not a table of"
                    " text."
                )
            if partial.endswith("\n"):
                yield partial
                partial = ""
        if partial:
            yield partial
