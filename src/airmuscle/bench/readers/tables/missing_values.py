"""Missing values: cells that are empty, markers, stated codes or no numbers; refused, left out or
interpolated.
"""

import abc
import dataclasses
import math
import re
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from ....core import Array, ColumnError, Hint, HintedText, check_field_types, one_line
from ....recording.columns import Heading
from ....recording.recording import RowNote, list_rows
from .channels import Cells, RawTable, taken
from .constants import parse_constant_name
from .time_base import seconds_from_clock

MAX_QUOTED = 40
MAX_LISTED = 8
"""Maximum number of characters of a cell among several, and of cells or rows that a message lists
(chosen).
"""
_MARKERS = re.compile(
    r"[-–—.?*/]*|nan|n/?a|null|none|missing|k\.?\s?a\.?|#[\w/]+[!?]?", re.IGNORECASE
)
Mask = npt.NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class ExaminedColumn:
    """Cells of a known quantity: which are missing and which are no numbers, each (N,)."""

    index: int
    heading: Heading
    cells: Cells
    missing: Mask
    bad: Mask

    def describe(self, row: int) -> str:
        """What is wrong with a cell, for a sentence."""
        cell = self.cells[row]
        if isinstance(cell, str):
            clock = " or a clock time" if self.heading.name == "time" else ""
            number = f"{self.heading.name} '{one_line(cell)}' is not a number{clock}"
            return number if cell else f"{self.heading.name} has an empty cell"
        reason = ", the code of a missing value" if math.isfinite(cell) else "; it must be finite"
        return f"{self.heading.name} is {cell:g}{reason}"

    def brief(self, row: int) -> str:
        """Quantity and cell, for a list."""
        cell = self.cells[row]
        text = (
            f"{cell:g}"
            if not isinstance(cell, str)
            else f"'{one_line(cell)[:MAX_QUOTED]}'"
            if cell
            else "empty"
        )
        return f"{self.heading.name} {text}"


def _examined(
    index: int, heading: Heading, cells: Cells, codes: Sequence[float | str]
) -> ExaminedColumn:
    # a code that is no number becomes NaN, which equals no cell
    numeric = [number(code) if isinstance(code, str) else code for code in codes]
    if not isinstance(cells, list):
        missing = np.isnan(cells) | np.isin(cells, numeric)
        return ExaminedColumn(index, heading, cells, missing, ~np.isfinite(cells) & ~missing)
    texts = {code.strip().lower() for code in codes if isinstance(code, str)}
    values = np.array([number(cell) for cell in cells])
    marked = []
    for cell in cells:
        text = cell.strip()
        marked.append(text.lower() in texts or bool(_MARKERS.fullmatch(text)))
    missing = np.array(marked) | np.isin(values, numeric)
    bad = ~np.isfinite(values) & ~missing
    if heading.name == "time" and bad.any():
        is_clock = np.array([seconds_from_clock((cell,)) is not None for cell in cells])
        if is_clock.any():
            bad = ~is_clock & ~missing
    return ExaminedColumn(index, heading, cells, missing, bad)


def number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _describe_faulty(table: RawTable, faulty_cells: Sequence[tuple[int, ExaminedColumn]]) -> str:
    """The cells with their rows in the file, and what to do."""
    if len(faulty_cells) == 1:
        ((row, column),) = faulty_cells
        return (
            f"{table.location(row)}: {column.describe(row)}. Correct the cell or delete the"
            f" {table.row_label}."
        )
    listed = [
        f"{table.row_label} {table.rows[row]} ({column.brief(row)})"
        for row, column in faulty_cells[:MAX_LISTED]
    ]
    more = f" and {len(faulty_cells) - MAX_LISTED} more" if len(faulty_cells) > MAX_LISTED else ""
    counts: dict[str, int] = {}
    for _, column in faulty_cells:
        counts[column.heading.text] = counts.get(column.heading.text, 0) + 1
    shares = [f"{count} of {len(table.rows)} cells of '{text}'" for text, count in counts.items()]
    return (
        f"{table.origin}: {' and '.join(shares)} are no finite numbers:"
        f" {', '.join(listed)}{more}. Correct the cells"
        f" or delete the {table.row_label}s."
    )


MAX_GAP = 5.0
"""Longest gap that is interpolated, in sample times between its neighbours (chosen; a longer one is
a gap in time).
"""
MAX_CODE = 20
"""Maximum number of characters of a text that is proposed as the code of a missing value
(chosen).
"""
_GROUPED = re.compile(r"[-+]?\d{1,3}(\.\d{3})+,\d*|[-+]?\d{1,3}(,\d{3})+\.\d*")
_HELD = ("branch", "fill", "discharge", "latched")


@dataclasses.dataclass(frozen=True)
class MissingValues(abc.ABC):
    """Treatment of missing values in the columns of known quantities.

    A value is missing where a cell is empty, not a number (NaN), a marker (`---`, `n/a`, `#N/A`,
    `#DIV/0!`), or one of the `codes`, numbers or texts that the data acquisition writes for missing
    values, such as -999.
    """

    codes: tuple[float | str, ...] = ()

    def __post_init__(self) -> None:
        check_field_types(self)

    def treat(self, table: RawTable, headings: Sequence[Heading]) -> RawTable:
        """The table with a number or time in each cell of a known quantity. Raises ColumnError,
        which lists others.
        """
        known = [
            i
            for i, heading in enumerate(headings)
            if heading.known or parse_constant_name(heading.text)
        ]
        cells = [_examined(i, headings[i], table.columns[i], self.codes) for i in known]
        strict = isinstance(self, RefuseMissing)
        faulty = [
            (column, column.bad | column.missing if strict else column.bad) for column in cells
        ]
        faulty_cells = [
            (int(row), column) for column, mask in faulty for row in np.flatnonzero(mask)
        ]
        if faulty_cells:
            faulty_cells.sort(key=lambda pair: pair[0])
            raise ColumnError(
                HintedText(_describe_faulty(table, faulty_cells), *_remedies(faulty_cells))
            )
        return self.completed(table, cells)

    @abc.abstractmethod
    def completed(self, table: RawTable, cells: list[ExaminedColumn]) -> RawTable:
        """The table without missing values, of which the cells of known quantities and of constants
        were examined.
        """


@dataclasses.dataclass(frozen=True)
class RefuseMissing(MissingValues):
    """Missing values are an error, which lists them."""

    def completed(self, table: RawTable, cells: list[ExaminedColumn]) -> RawTable:
        return table


@dataclasses.dataclass(frozen=True)
class DropMissing(MissingValues):
    """Rows with a missing value are left out; a note reports them."""

    def completed(self, table: RawTable, cells: list[ExaminedColumn]) -> RawTable:
        return (
            _without_rows(table, np.any([column.missing for column in cells], axis=0))
            if cells
            else table
        )


@dataclasses.dataclass(frozen=True)
class InterpolateMissing(MissingValues):
    """Missing values are interpolated linearly in time where the gap is short; the other rows are
    left out.

    A gap is short if the readings before and after it are at most MAX_GAP = 5 sample times (median
    steps) apart. Valve commands, branches and latches keep the value before the gap. Requires time.
    """

    def completed(self, table: RawTable, cells: list[ExaminedColumn]) -> RawTable:
        if not any(column.missing.any() for column in cells):
            return table
        timed = next((column for column in cells if column.heading.name == "time"), None)
        if timed is None:
            raise ColumnError(
                f"{table.origin}: missing values are interpolated in time, but there is no time"
                " column.",
                hint=Hint(
                    "To leave out the rows", "missing", DropMissing(self.codes), "ColumnMapping"
                ),
            )
        timed_rows = np.flatnonzero(~timed.missing)
        table = _without_rows(table, timed.missing)
        cells = [
            dataclasses.replace(
                c,
                cells=taken(c.cells, timed_rows),
                missing=c.missing[timed_rows],
                bad=c.bad[timed_rows],
            )
            for c in cells
        ]
        time = taken(timed.cells, timed_rows)  # [in the unit of the file]
        if isinstance(time, list):
            clock = seconds_from_clock(time)
            time = np.array([float(cell) for cell in time]) if clock is None else clock
        columns, filled, left = list(table.columns), *np.zeros((2, len(time)), dtype=bool)
        for column in cells:
            if column.missing.any():
                columns[column.index], done = _interpolated(column, time)
                filled = filled | done
                left = left | (column.missing & ~done)
        table = dataclasses.replace(table, columns=tuple(columns))
        if (filled & ~left).any():
            table = table.noted(
                _row_note(table, "with values interpolated in time", filled & ~left)
            )
        return _without_rows(table, left)


MISSING_VALUES: dict[str, type[MissingValues]] = {
    "error": RefuseMissing,
    "drop": DropMissing,
    "interpolate": InterpolateMissing,
}
"""Treatments by their names in mapping files and on the command line."""


def parse_code(code: float | str) -> float | str:
    """The code of a missing value: the number that a text states, or else the text without outer
    blanks.
    """
    try:
        return float(code)
    except ValueError:
        return str(code).strip()


def _remedies(faulty_cells: Sequence[tuple[int, ExaminedColumn]]) -> Iterator[Hint]:
    bad = list(dict.fromkeys(column.cells[row] for row, column in faulty_cells if column.bad[row]))
    texts = [cell for cell in bad if isinstance(cell, str)]
    grouped = next(filter(_GROUPED.fullmatch, texts), None)
    if grouped is not None:
        sign = "," if grouped.rfind(",") > grouped.rfind(".") else "."
        yield Hint("To specify the decimal sign", "decimal", sign, "ColumnMapping")
    elif (
        len(bad) == len(texts) == 1
        and len(texts[0]) <= MAX_CODE
        and not any(map(str.isdigit, texts[0]))
    ):
        yield Hint(
            f"If '{texts[0]}' stands for a missing value",
            "missing",
            DropMissing((texts[0],)),
            "ColumnMapping",
        )
    if any(column.missing[row] for row, column in faulty_cells):
        yield Hint(
            "To leave out the rows with missing values", "missing", DropMissing(), "ColumnMapping"
        )
        yield Hint("To interpolate short gaps", "missing", InterpolateMissing(), "ColumnMapping")


def _without_rows(table: RawTable, left_out: Mask) -> RawTable:
    if not left_out.any():
        return table
    if left_out.all():
        raise ColumnError(f"{table.origin}: every row contains a missing value; no row is left.")
    note = _row_note(table, "left out, because a value is missing", left_out)
    return table.of_rows(np.flatnonzero(~left_out)).noted(note)


def _row_note(table: RawTable, what: str, rows: Mask) -> RowNote:
    listed = list_rows(table.row_label, table.rows[rows], MAX_LISTED)
    return RowNote(
        f"{table.origin}: rows {what}: {np.count_nonzero(rows)} of {len(rows)} ({listed})."
    )


def _interpolated(column: ExaminedColumn, time: Array) -> tuple[Array, Mask]:
    """The values (N,) with short gaps filled, and the filled rows."""
    values = np.array(
        [number(c) for c in column.cells] if isinstance(column.cells, list) else column.cells
    )
    known = np.flatnonzero(~column.missing)
    rows = np.flatnonzero(column.missing)
    steps = np.diff(time)
    sample_time = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    after = np.searchsorted(known, rows)
    inside = (after > 0) & (after < len(known))
    rows = rows[inside]
    after = after[inside]
    span = time[known[after]] - time[known[after - 1]]
    short = (span > 0) & (span <= (MAX_GAP + 1e-6) * sample_time)
    rows = rows[short]
    first = known[after - 1][short]
    last = known[after][short]
    span = span[short]
    share = (
        0.0
        if column.heading.name.rpartition(".")[2] in _HELD
        else (time[rows] - time[first]) / span
    )
    values[rows] = values[first] + share * (values[last] - values[first])
    return values, np.isin(np.arange(len(time)), rows)
