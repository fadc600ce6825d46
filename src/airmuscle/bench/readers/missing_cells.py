"""Examination of the cells of a table: which values are missing, and which cells are no numbers."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...recording.heading import Heading
from .clock import seconds_from_clock
from .constants import parse_constant_name
from .table import Cells, RawTable

MAX_LISTED = 8
"""Maximum number of cells or rows that a message lists (chosen)."""
_MARKERS = re.compile(r"[-–—.?*/]*|nan|n/?a|null|none|missing|k\.?\s?a\.?|#[\w/]+[!?]?", re.IGNORECASE)
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
            number = f"{self.heading.name} '{cell}' is not a number{clock}"
            return number if cell else f"{self.heading.name} has an empty cell"
        reason = ", the code of a missing value" if math.isfinite(cell) else "; it must be finite"
        return f"{self.heading.name} is {cell:g}{reason}"

    def brief(self, row: int) -> str:
        """Quantity and cell, for a list."""
        cell = self.cells[row]
        text = f"{cell:g}" if not isinstance(cell, str) else f"'{cell}'" if cell else "empty"
        return f"{self.heading.name} {text}"


def examine(table: RawTable, headings: Sequence[Heading], codes: Sequence[float | str]) -> list[ExaminedColumn]:
    """The columns of known quantities and of constants."""
    known = [i for i, each in enumerate(headings) if each.known or parse_constant_name(each.text)]
    return [_examine_column(i, headings[i], table.columns[i], codes) for i in known]


def _examine_column(index: int, heading: Heading, cells: Cells, codes: Sequence[float | str]) -> ExaminedColumn:
    numeric = [number(code) if isinstance(code, str) else code for code in codes]  # NaN equals no cell
    if not isinstance(cells, list):
        missing = np.isnan(cells) | np.isin(cells, numeric)
        return ExaminedColumn(index, heading, cells, missing, ~np.isfinite(cells) & ~missing)
    texts = {code.strip().lower() for code in codes if isinstance(code, str)}
    values = np.array([number(cell) for cell in cells])
    marked = np.array([cell.strip().lower() in texts or bool(_MARKERS.fullmatch(cell.strip())) for cell in cells])
    missing = marked | np.isin(values, numeric)
    bad = ~np.isfinite(values) & ~missing
    if heading.name == "time" and bad.any():
        times = np.array([seconds_from_clock((cell,)) is not None for cell in cells])
        bad = ~times & ~missing if times.any() else bad
    return ExaminedColumn(index, heading, cells, missing, bad)


def number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def faulty_cells(columns: Sequence[ExaminedColumn], *, missing: bool) -> list[tuple[int, ExaminedColumn]]:
    """The rows and columns of the cells that are no numbers, by row; with `missing` also those without a value."""
    masks = [each.bad | each.missing if missing else each.bad for each in columns]
    found = [(int(row), each) for each, mask in zip(columns, masks, strict=True) for row in np.flatnonzero(mask)]
    return sorted(found, key=lambda pair: pair[0])


def describe_faulty(table: RawTable, found: Sequence[tuple[int, ExaminedColumn]]) -> str:
    """The cells with their rows in the file, and what to do."""
    if len(found) == 1:
        ((row, each),) = found
        return f"{table.location(row)}: {each.describe(row)}. Correct the cell or delete the {table.row_label}."
    listed = [f"{table.row_label} {table.rows[row]} ({each.brief(row)})" for row, each in found[:MAX_LISTED]]
    more = f" and {len(found) - MAX_LISTED} more" if len(found) > MAX_LISTED else ""
    rows = len({row for row, _ in found})
    return (
        f"{table.origin}: {len(found)} cells in {rows} of {len(table.rows)} {table.row_label}s are no finite numbers: "
        f"{', '.join(listed)}{more}. Correct the cells or delete the {table.row_label}s."
    )
