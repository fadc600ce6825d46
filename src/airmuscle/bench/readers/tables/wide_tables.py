"""Wide tables as tables of columns: groups of columns side by side, one for each specimen or load,
and grids of a force over contraction and pressure.
"""

import dataclasses
import re
from collections.abc import Sequence

import numpy as np

from ....core import ColumnError, FileError, Hint, counted
from ....recording.columns import parse_heading
from ....recording.vocabulary import Reading, read_heading
from .channels import Cells, RawTable, numbers_if_all
from .constants import SPECIMEN
from .header import is_number

MAX_WIDTH = 400
"""Greatest number of columns in which groups and grids are sought (chosen)."""
MIN_GRID = 2
"""Least number of rows and columns of a grid (chosen)."""
_LABEL = re.compile(r"(?P<name>\D*?)\s*(?P<value>[-+]?\d+(?:[.,]\d+)?)\s*(?P<unit>[^\d\s]\S*)")
_CORNER = re.compile(r"\s*(?:\\|\||→|\bover\b|\bvs\.?\b|\bversus\b|;)\s*|\s+/\s+", re.IGNORECASE)
_STATED = re.compile(r"(?P<cells>.+?)\s+over\s+(?P<down>.+?)\s*,\s*(?P<across>.+)")


# Groups side by side


def split_groups(table: RawTable) -> tuple[RawTable, ...]:
    """The tables of groups of columns that stand side by side under the same headings, with the
    columns before the first group in each; the table itself without such groups.

    What stands above a group is the specimen, or a constant, `200 g`.
    """
    headings = list(table.headings)
    used = [i for i, heading in enumerate(headings) if heading or _has_content(table.columns[i])]
    shared, width = _period([_plain(headings[i]) for i in used])
    if not width:
        return (table,)
    labels = _labels(table)
    tables = []
    for number, begin in enumerate(range(shared, len(used), width), 1):
        columns = used[begin : begin + width]
        label = labels[columns[0]] if labels else ""
        origin = f"{table.origin}, {label or f'group {number}'}"
        part = table.of_columns([*used[:shared], *columns], origin=origin, above=())
        bare = tuple(re.sub(r"\.\d+$", "", heading) for heading in part.headings)
        part = dataclasses.replace(part, headings=bare)
        tables.append(_labelled(_without_empty_rows(part), label))
    return tuple(tables)


def _plain(heading: str) -> str:
    """A heading without the number that pandas adds to a repeated one, `force.1`."""
    return re.sub(r"\.\d+$", "", heading).strip().casefold()


def _period(headings: Sequence[str]) -> tuple[int, int]:
    """The number of columns before equal groups and the width of these; width 0 without groups."""
    for shared in (0, 1):
        rest = headings[shared:]
        for width in range(2, len(rest) // 2 + 1):
            if _repeats(rest, width):
                return shared, width
    return 0, 0


def _repeats(headings: Sequence[str], width: int) -> bool:
    """Whether headings consist of equal groups of a width, of different ones each."""
    if len(headings) % width:
        return False
    first = headings[:width]
    if not all(first) or len(set(first)) < width:
        return False
    groups = range(0, len(headings), width)
    return all(headings[i : i + width] == first for i in groups)


def _labels(table: RawTable) -> list[str]:
    """What stands above each column, also that of the first column of its group."""
    labels = []
    last = ""
    for cell in table.above:
        last = cell or last
        labels.append(last)
    return labels if len(labels) == len(table.headings) else []


def _has_content(cells: Cells) -> bool:
    return not isinstance(cells, list) or any(cell.strip() for cell in cells)


def _without_empty_rows(table: RawTable) -> RawTable:
    """The table without the rows below the end of a shorter group."""
    texts = [cells for cells in table.columns if isinstance(cells, list)]
    if not texts:
        return table
    filled = np.array(
        [
            any(not isinstance(cells, list) or cells[row].strip() for cells in table.columns)
            for row in range(len(table.rows))
        ]
    )
    last = int(np.flatnonzero(filled)[-1]) + 1 if filled.any() else 0
    kept = table.of_rows(np.arange(last))
    return dataclasses.replace(
        kept,
        columns=tuple(
            numbers_if_all(cells) if isinstance(cells, list) else cells for cells in kept.columns
        ),
    )


def _labelled(table: RawTable, label: str) -> RawTable:
    """The table with the specimen or the constant that stands above it."""
    if not label:
        return table
    constant = _constant_of(label)
    present = [_quantity(heading) for heading in table.headings]
    if constant and constant[0] not in present:
        name, value = constant
        note = f"'{label}' above the columns is read as {name} = {value}."
        return dataclasses.replace(table, constants={**table.constants, name: value}).noted(note)
    return dataclasses.replace(table, constants={**table.constants, SPECIMEN: label})


def _constant_of(label: str) -> tuple[str, str] | None:
    """Quantity and value of a label such as `Load 200 g`; None for a name."""
    match = _LABEL.fullmatch(label.strip())
    if match is None:
        return None
    reading = read_heading(f"{match['name']} [{match['unit']}]")
    if reading is None or reading.unit is None:
        return None
    return reading.quantity, f"{match['value'].replace(',', '.')} {reading.unit}"


def _quantity(heading: str) -> str:
    parsed = parse_heading(heading)
    reading = None if parsed.known else read_heading(heading)
    return parsed.name if parsed.known else reading.quantity if reading else ""


# Grids


@dataclasses.dataclass(frozen=True)
class GridHeadings:
    """Headings of a grid: of its cells, of its first column and of its row of headings."""

    cells: str
    down: str
    across: str

    @property
    def text(self) -> str:
        """The grid as a mapping states it."""
        return f"{self.cells} over {self.down}, {self.across}"


UNKNOWN_GRID = GridHeadings("force [?]", "contraction [?]", "pressure [?]")
"""The grid of a table that states nothing of it."""


def parse_grid(text: str) -> GridHeadings:
    """The grid of a text such as `force [N] over contraction [%], pressure [kPa]`. Raises
    ColumnError.
    """
    match = _STATED.fullmatch(text.strip())
    if match is None or "?" in text:
        raise ColumnError(
            f"grid is '{text}'; write the quantities of cells, first column and headings, such as"
            " 'force [N] over contraction [%], pressure [kPa]'."
        )
    return GridHeadings(match["cells"], match["down"], match["across"])


def is_grid(table: RawTable) -> bool:
    """Whether all headings but the first are numbers that rise or fall, and no column numbers."""
    numbers = [heading.replace(",", ".") for heading in table.headings[1:]]
    if min(len(numbers), len(table.rows)) < MIN_GRID:
        return False
    if is_number(table.headings[0]):
        return False
    if not all(map(is_number, numbers)):
        return False
    values = [float(number) for number in numbers]
    steps = np.diff(values)
    is_sorted = bool(np.all(steps > 0) or np.all(steps < 0))
    is_numbering = values == list(range(1, len(values) + 1))
    return is_sorted and not is_numbering


def grid_of(table: RawTable) -> GridHeadings | None:
    """The quantities of a grid by its corner, `contraction [%] \\ pressure [kPa]`, or by what
    stands above; question marks stand for what is open. None where nothing is stated.
    """
    first = table.headings[0]
    corner = [part for part in _CORNER.split(first) if part]
    named = [heading for part in corner if (heading := _heading(part))]
    above = [heading for cell in table.above if (heading := _heading(cell))]
    if len(named) < 2 and above:
        named = [*named, *(h for h in above if not h.startswith("force"))]
    if len(named) < 2:
        return None
    stated = [h for h in (*above, _heading(table.origin)) if h.startswith("force")]
    return GridHeadings(stated[0] if stated else "force [?]", named[0], named[1])


def _heading(text: str) -> str:
    """Quantity and unit of a text, as a heading; empty if it states none."""
    reading: Reading | None = read_heading(text)
    return "" if reading is None else f"{reading.quantity} [{reading.unit or '?'}]"


def table_of_grid(table: RawTable, grid: GridHeadings) -> RawTable:
    """The columns of a grid: a row for each cell. Empty cells are left out, and said. Raises
    FileError where the table is no grid.
    """
    if not is_grid(table):
        raise FileError(
            f"{table.origin}: the table is no grid: its headings, but the first, must be numbers"
            " that rise."
        )
    down, *columns = (_numbers(cells) for cells in table.columns)
    across = np.array([float(heading.replace(",", ".")) for heading in table.headings[1:]])
    cells = np.column_stack(columns)
    rows, places = np.nonzero(np.isfinite(cells) & np.isfinite(down)[:, None])
    left_out = cells.size - len(rows)
    rest = f"; {counted(left_out, 'empty cell')} left out" if left_out else ""
    note = f"A grid of {len(down)} x {len(across)} cells is read as {grid.text}{rest}."
    return RawTable(
        table.origin,
        (grid.down, grid.across, grid.cells),
        None,
        (down[rows], across[places], cells[rows, places]),
        table.rows[rows],
        table.row_label,
        table.constants,
        (*table.notes, note),
    )


def _numbers(cells: Cells) -> np.ndarray:
    if not isinstance(cells, list):
        return cells
    return np.array([float(c.replace(",", ".")) if is_number(c) else np.nan for c in cells])


def unwound(table: RawTable, stated: str | None = None) -> tuple[RawTable, ...]:
    """The tables of columns of a wide table: of its grid, as the user states it or its own headings
    do, and of its groups side by side.
    """
    if len(table.headings) > MAX_WIDTH:
        return (table,)
    if stated is not None:
        return (table_of_grid(table, parse_grid(stated)),)
    if is_grid(table):
        grid = grid_of(table)
        if grid is None or "?" in grid.text:
            example = grid or UNKNOWN_GRID
            raise ColumnError(
                f"{table.origin}: the table is a grid of numbers over"
                f" {len(table.headings) - 1} values in its headings and {len(table.rows)} in its"
                " first column, and its quantities or units are not all stated.",
                hint=Hint("To state them", "grid", example.text, "ColumnMapping"),
            )
        return (table_of_grid(table, grid),)
    return split_groups(table)
