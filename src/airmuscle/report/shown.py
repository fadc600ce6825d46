"""Tables and quantities as they are shown, with headings and units; tables of parameters and of
estimates.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from ..core import (
    chosen_scale,
    conversion,
    heading_scale,
    known_factor,
    scaled_numbers,
)
from .chapter import BY_ROW, NamedValue, Table, TableColumn
from .formatting import (
    P_VALUE,
    format_cell,
    format_number,
    format_p_value,
    format_unit,
    is_number_text,
)

UNIT = "unit"
MEANING = "meaning"
SYMBOL = "symbol"
"""Names of columns with a special form."""
BRIEF_ROWS = 12
"""Maximum number of rows of estimates in the brief view (chosen)."""
_ANR = " (ANR)"
"""End of the unit of a volume of air at the reference atmosphere of ISO 8778."""


@dataclasses.dataclass(frozen=True)
class ShownColumn:
    """A column as it is shown: heading with unit, and cells in this unit."""

    heading: str
    cells: list[Any]
    column: TableColumn

    @property
    def is_numeric(self) -> bool:
        """Whether all cells are numbers, which are aligned to the right."""
        return all(not isinstance(cell, str | bool) or is_number_text(cell) for cell in self.cells)

    def cell_text(self, cell: Any) -> str:
        """A cell in typographic form; the heading decides on the format of units and p-values."""
        if self.heading == P_VALUE:
            return format_p_value(cell)
        if self.heading == UNIT and isinstance(cell, str):
            return format_unit(cell)
        return format_cell(cell, self.column.digits)

    @property
    def texts(self) -> list[str]:
        """The cells as text with their significant digits."""
        return [format_number(cell, self.column.digits) for cell in self.cells]


def shown_columns(table: Table, *, chosen: bool = True, brief: bool = False) -> list[ShownColumn]:
    """The columns of a table as they are shown, in the units of the user's choice or, for a file,
    in the declared ones.

    A meaning that is that of the row above, as of the coefficients of a polynomial, is shown once.
    """
    rows = table.brief_rows if brief else list(range(len(table)))
    scales = _scales_of_rows(table, rows, chosen=chosen)
    shown = []
    for name, column in table.columns.items():
        if brief and not column.brief:
            continue
        cells = [column.values[i] for i in rows]
        heading = (brief and column.short) or name
        if name == UNIT and column.unit != BY_ROW:
            cells = ["" if unit == "1" else unit for _, unit in scales]
        else:
            cells, heading = _scaled_cells(name, heading, column, cells, scales, chosen=chosen)
        if chosen and heading == MEANING:
            cells = _without_repetition(cells)
        shown.append(ShownColumn(heading, cells, column))
    return shown


def _scaled_cells(
    name: str,
    heading: str,
    column: TableColumn,
    cells: Sequence[Any],
    scales: Sequence[tuple[float, str]],
    *,
    chosen: bool,
) -> tuple[list[Any], str]:
    """The cells in the units in which they are shown, each in that of its row or all in one, and
    the heading with the unit of all."""
    if column.unit == BY_ROW:
        factors = [factor for factor, _ in scales]
    else:
        factor, heading = _scaled_heading(name, heading, column, chosen=chosen)
        factors = [factor] * len(cells)
    return list(map(_times, cells, factors)), heading


def _scales_of_rows(table: Table, rows: Sequence[int], *, chosen: bool) -> list[tuple[float, str]]:
    """Factor from SI and unit of each row, of a table that states units by row; otherwise none."""
    units = table.columns.get(UNIT, TableColumn(()))
    if not len(units):
        return []
    labels = units.shown or units.values
    scales = []
    for row in rows:
        scale = scale_of("", units.values[row], labels[row], chosen=chosen)
        scales.append(scale)
    return scales


def _scaled_heading(
    name: str, heading: str, column: TableColumn, *, chosen: bool
) -> tuple[float, str]:
    """Factor from the stored cells to those that are shown, and the heading with its unit."""
    if column.unit:
        factor, unit = scale_of(name, column.unit, str(column.shown), chosen=chosen)
        is_plain = unit == "" or (unit == "1" and chosen)
        return factor, heading if is_plain else f"{heading} [{unit}]"
    return heading_scale(heading) if chosen else (1.0, heading)


def _without_repetition(cells: Sequence[Any]) -> list[Any]:
    """The cells, empty where they are equal to the one above."""
    later = ["" if cell == above else cell for above, cell in itertools.pairwise(cells)]
    return [*cells[:1], *later]


def scale_of(name: str, unit: str, shown: str = "", *, chosen: bool = True) -> tuple[float, str]:
    """Factor from SI, and the unit in which a quantity is shown. A ratio has a unit of choice only
    as contraction.
    """
    label = shown or unit
    factor = 1.0
    if label != unit:
        plain = label.removesuffix(_ANR)
        si_unit = unit.removesuffix(_ANR)
        factor = 1.0 / (known_factor(plain, 0.0) or conversion(plain, si_unit).factor)
    if chosen and (unit != "1" or "contraction" in name.lower()):
        return chosen_scale(unit, factor, label)
    return factor, label


def value_cells(named: NamedValue) -> tuple[str, str]:
    """A named value as text, and its unit in the choice of the user."""
    if (
        not named.unit
        or not isinstance(named.value, int | float | tuple)
        or isinstance(named.value, bool)
    ):
        return format_number(named.value, named.digits), ""
    factor, unit = scale_of(named.name, named.unit, named.shown)
    return format_number(_times(named.value, factor), named.digits), "" if unit == "1" else unit


def value_text(named: NamedValue) -> str:
    """A named value as text with its unit and remark."""
    return " ".join(filter(None, (*value_cells(named), named.remark)))


def _times(value: Any, factor: float) -> Any:
    """A cell, each end of a range, or the numbers of a text, times a factor."""
    if factor == 1.0 or value is None or isinstance(value, bool):
        return value
    if isinstance(value, tuple):
        return tuple(_times(end, factor) for end in value)
    return scaled_numbers(value, factor) if isinstance(value, str) else value * factor


def value_table(name: str, title: str, values: tuple[NamedValue, ...]) -> Table:
    """The named values of a chapter as a table."""
    columns: Mapping[str, Any] = {
        "quantity": [named.name for named in values],
        "value": [" ".join(filter(None, value_cells(named))) for named in values],
    }
    remarks = [named.remark for named in values]
    return Table(name, title, {**columns, "remark": remarks} if any(remarks) else columns)
