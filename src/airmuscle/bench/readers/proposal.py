"""Proposal of a mapping: a ready mapping file for the columns that a file does not state enough of.

What several readings fit is a question, written as '?', which the user answers in the file, or by
--unit or --column.
"""

import dataclasses
import json
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...recording.columns import QUANTITIES, UNIT_SPELLINGS
from ...recording.vocabulary import MATRIX_COLUMN, SIGN_OPEN, dimension, unit_named
from .column_names import ReadColumn, quantities_of_units, read_columns
from .mapping import QUESTION, ColumnMapping
from .reader import read_tables
from .tables import (
    UNKNOWN_GRID,
    Cells,
    Decimation,
    RawTable,
    epoch_unit,
    file_conversion,
    grid_of,
    guessed_time_unit,
    is_clock,
    is_grid,
    split_groups,
)

LENGTHS = "length, shortening, elongation or position"
"""Quantities of a unit of length."""
MAX_ROWS = 20_000
"""Rows of a file from which a mapping is proposed (chosen)."""
LIKELY_UNITS: Mapping[str, tuple[str, ...]] = {
    "Pa": ("bar", "kPa", "MPa", "psi"),
    "N": ("N", "kg", "lbf"),
    "m": ("mm", "cm", "m"),
    "rad": ("deg", "rad"),
    "s": ("s", "ms", "us"),
    "1": ("%", "1"),
}
"""Units that are offered for a column that states none, by SI unit."""
_USUAL_MAXIMA: Mapping[str, tuple[float, float]] = {
    "Pa": (2e4, 2e6),
    "N": (0.5, 2e4),
    "m": (5e-4, 5.0),
    "rad": (0.02, 12.6),
    "1": (1e-3, 1.0),
}
"""Range of the greatest magnitude of a column in SI units that is usual for a muscle (chosen)."""


@dataclasses.dataclass(frozen=True)
class ProposedColumn:
    """A line of a mapping: `key` is the heading or the number of a column, `reading` quantity and
    unit, where a question mark stands for what is open.
    """

    key: str
    reading: str
    remark: str = ""

    @property
    def is_question(self) -> bool:
        """Whether the user must answer something."""
        return QUESTION in self.reading

    @property
    def line(self) -> str:
        """The line of a mapping file."""
        key = self.key if self.key.isdecimal() else json.dumps(self.key, ensure_ascii=False)
        remark = f"  # {self.remark}" if self.remark else ""
        return f"{key} = {json.dumps(self.reading, ensure_ascii=False)}{remark}"


@dataclasses.dataclass(frozen=True)
class Proposal:
    """The mapping that is proposed for a file; without columns, the file states all itself."""

    file: str
    columns: tuple[ProposedColumn, ...] = ()
    unused: tuple[str, ...] = ()
    grid: str = ""
    decimal: str = ""

    def __bool__(self) -> bool:
        return bool(self.columns or self.grid or self.decimal)

    @property
    def questions(self) -> int:
        """Number of lines that the user must answer."""
        return sum(column.is_question for column in self.columns) + (QUESTION in self.grid)

    @property
    def open_units(self) -> list[str]:
        """The quantities whose unit is open."""
        names = [c.reading.partition(" [")[0] for c in self.columns if f"[{QUESTION}]" in c.reading]
        return list(dict.fromkeys(name.rpartition(".")[2] for name in names if name != QUESTION))

    @property
    def toml(self) -> str:
        """The text of the mapping file."""
        lines = [f"# mapping proposed for {self.file}"]
        if self.questions:
            lines.append(f"# answer each {QUESTION} : it stands for what the file does not state")
        if self.grid:
            lines.append(f"grid = {json.dumps(self.grid)}  # cells over first column, headings")
        if self.decimal:
            remark = "guess: the last dot is the decimal point; ',' if all separate thousands"
            lines.append(f"decimal = {json.dumps(self.decimal)}  # {remark}")
        if self.columns:
            lines += ["[columns]", *(column.line for column in self.columns)]
        if self.unused:
            lines.append(f"# not used: {', '.join(self.unused)}")
        return "\n".join(line.replace("\r", " ") for line in lines) + "\n"

    @property
    def options(self) -> str:
        """The same as options of a command."""
        stated = [f"--decimal {self.decimal}"] if self.decimal else []
        if self.grid:
            stated.append(f"--grid {shlex.quote(self.grid)}")
        for column in self.columns:
            stated.append(f"--column {shlex.quote(f'{column.key}={column.reading}')}")
        return " ".join(stated)


def propose(path: str | Path, mapping: ColumnMapping = ColumnMapping()) -> Proposal:
    """The mapping that completes a file, besides what `mapping` states. Raises FileError or
    ColumnError for a file without a table.
    """
    path = Path(path)
    numbered = dataclasses.replace(mapping, columns={**mapping.columns, 1: ""})
    tables = read_tables(path, numbered, Decimation())
    decimal = ""
    if mapping.decimal is None and any(map(_has_dots_for_thousands, tables)):
        decimal = "."
        numbered = dataclasses.replace(numbered, decimal=decimal)
        tables = read_tables(path, numbered, Decimation())
    parts = []
    for table in tables:
        parts += [propose_for_table(part, mapping) for part in split_groups(table)]
    lines = {column.key: column for part in parts for column in part.columns}
    unused = dict.fromkeys(name for part in parts for name in part.unused)
    grid = next((part.grid for part in parts if part.grid), "")
    return Proposal(path.name, tuple(lines.values()), tuple(unused), grid, decimal)


_DOTS = re.compile(r"[-+]?\d{1,3}(\.\d{3}){2,}")
"""A number with dots for thousands and for decimals, or for thousands alone."""


def _has_dots_for_thousands(table: RawTable) -> bool:
    """Whether numbers of a table have several dots, `1.003.000`."""
    texts = (cells for cells in table.columns if isinstance(cells, list))
    return any(_DOTS.fullmatch(cell) for cells in texts for cell in cells)


def propose_for_table(table: RawTable, mapping: ColumnMapping) -> Proposal:
    """The mapping that completes a table."""
    if mapping.grid is None and is_grid(table):
        grid = grid_of(table) or UNKNOWN_GRID
        is_open = QUESTION in grid.text
        return Proposal(table.origin, grid=grid.text if is_open else "")
    rows = min(len(table.rows), MAX_ROWS)
    few = table.of_rows(np.arange(rows))
    columns = read_columns(few, quantities_of_units(mapping.units))
    counts = Counter(few.headings)
    names = _names(columns)
    mapped = set(map(str, mapping.columns))
    is_understood = any(column.heading.known or column.is_open for column in columns)
    read_already = {column.heading.name for column in columns if column.heading.known}
    lines = []
    unused = []
    for i, (column, cells) in enumerate(zip(columns, few.columns, strict=True)):
        text = column.heading.text
        number = str(few.number(i))
        if mapped & {text, number}:
            continue
        key = text if text and counts[text] == 1 else number
        if column.is_open and names[i] in read_already:
            unused.append(text)
            continue
        line = _line(key, names[i], column, cells, is_understood)
        is_left_out = not column.heading.known and not isinstance(cells, list)
        if line is not None:
            lines.append(line)
        elif text and is_left_out:
            unused.append(text)
    return Proposal(table.origin, tuple(lines), tuple(unused))


def _names(columns: Sequence[ReadColumn]) -> list[str]:
    """The proposed name of each column: those of one quantity are told apart by their words."""
    quantities = []
    for column in columns:
        is_open = column.is_open and column.reading is not None
        quantities.append(column.reading.quantity if is_open and column.reading else "")
    taken = Counter(
        [*filter(None, quantities), *(c.heading.name for c in columns if c.heading.known)]
    )
    names = []
    for column, quantity in zip(columns, quantities, strict=True):
        words = "_".join(column.reading.qualifiers) if column.reading else ""
        prefix = f"sensor{words}" if words.isdigit() else words
        is_apart = taken[quantity] > 1 and prefix
        names.append(f"{prefix}.{quantity}" if quantity and is_apart else quantity)
    counts = Counter(names)
    return [
        f"sensor{i}.{name}" if name and counts[name] > 1 else name
        for i, name in enumerate(names, 1)
    ]


def _line(
    key: str, name: str, column: ReadColumn, cells: Cells, is_understood: bool
) -> ProposedColumn | None:
    """The line of a column; None where nothing is open, or nothing is known of it."""
    heading = column.heading
    if heading.known:
        is_settled = heading.unit or heading.target == "1" or is_clock(cells)
        is_guessed = heading.name == "time" and (epoch_unit(cells) or guessed_time_unit(cells))
        if is_settled or is_guessed:
            return None
        return _with_unit(key, heading.name, cells)
    if column.is_open and column.reading is not None:
        reading = column.reading
        if reading.quantity in SIGN_OPEN and reading.unit:
            remark = (
                "guess: positive as the muscle is stretched, from its resting length; else"
                " shortening or position"
            )
            return ProposedColumn(key, f"{name} [{reading.unit}]", remark)
        if reading.unit:
            return ProposedColumn(
                key, f"{name} [{reading.unit}]", "guess: quantity or sign is not stated"
            )
        return _with_unit(key, name, cells)
    unit = unit_named(heading.text) or (heading.unit and unit_named(heading.unit))
    if unit and dimension(unit) == "m":
        return ProposedColumn(key, f"{QUESTION} [{unit}]", LENGTHS)
    is_of_matrix = MATRIX_COLUMN.search(heading.text) is not None
    if (is_understood and not is_of_matrix) or isinstance(cells, list):
        return None
    guess = guessed_time_unit(cells) if column.is_first and not _is_counter(cells) else None
    if guess is not None:
        return ProposedColumn(key, f"time [{guess.unit}]", "guess: it rises evenly")
    remark = f"quantity and unit, or empty to leave out; {_description(cells)}"
    return ProposedColumn(key, QUESTION, remark)


def _is_counter(cells: Cells) -> bool:
    """Whether a column counts rows."""
    return not isinstance(cells, list) and bool(np.all(np.diff(cells) == 1.0))


def _with_unit(key: str, name: str, cells: Cells) -> ProposedColumn:
    """The line of a known quantity without unit, with the units among which the user chooses."""
    quantity = name.rpartition(".")[2]
    target = QUANTITIES[quantity].unit
    units = LIKELY_UNITS.get(target, UNIT_SPELLINGS[target])
    possible = [unit for unit in units if _is_usual(cells, unit, target)] or list(units)
    return ProposedColumn(
        key, f"{name} [{QUESTION}]", f"{' or '.join(possible)}? {_description(cells)}"
    )


def _is_usual(cells: Cells, unit: str, target: str) -> bool:
    """Whether the greatest magnitude of a column is usual in a unit."""
    low, high = _USUAL_MAXIMA.get(target, (0.0, np.inf))
    if isinstance(cells, list) or not len(cells):
        return True
    size = float(np.nanmax(np.abs(cells))) * file_conversion(unit, target).factor
    return low <= size <= high


def _description(cells: Cells) -> str:
    """The range of the numbers of a column, and whether they rise evenly as times do."""
    if isinstance(cells, list) or not len(cells):
        return "texts"
    finite = cells[np.isfinite(cells)]
    if not len(finite):
        return "no number"
    rises = len(finite) > 2 and bool(np.all(np.diff(finite) > 0))
    return f"{finite.min():.4g} to {finite.max():.4g}{', rising: time?' if rises else ''}"


def merged(proposals: Iterable[Proposal]) -> Proposal:
    """One mapping for several files: the lines of each, once."""
    files = [proposal for proposal in proposals if proposal]
    lines: dict[str, ProposedColumn] = {}
    for proposal in files:
        for column in proposal.columns:
            lines[column.key] = column
    grids = [proposal.grid for proposal in files if proposal.grid]
    names = dict.fromkeys(proposal.file for proposal in files)
    return Proposal(
        ", ".join(names),
        tuple(lines.values()),
        grid=grids[0] if grids else "",
        decimal="".join({proposal.decimal for proposal in files})[:1],
    )
