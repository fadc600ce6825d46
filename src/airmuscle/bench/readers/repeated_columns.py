"""Columns of a table: their number; equal ones are read once; different ones of one quantity are an error."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...core.errors import ColumnError
from ...recording.heading import Heading
from .table import Cells, RawTable

MAX_COLUMNS = 5000
"""Maximum number of columns of a table (chosen)."""


def without_repeated_columns(table: RawTable) -> RawTable:
    """The table without the columns that repeat heading, unit and cells of a column before; a note names them."""
    units = table.units or ("",) * len(table.headings)
    kept, repeated = list[int](), list[str]()
    same: dict[tuple[str, str], list[int]] = {}
    for i, pair in enumerate(zip(table.headings, units, strict=True)):
        before = same.setdefault(pair, [])
        if pair[0] and any(_equal(table.columns[k], table.columns[i]) for k in before):
            repeated.append(pair[0])
        else:
            kept.append(i)
            before.append(i)
    if not repeated:
        return table
    names = ", ".join(f"'{name}'" for name in dict.fromkeys(repeated))
    note = f"Columns that repeat the values of an equally named column are read once: {names}."
    return dataclasses.replace(
        table,
        headings=tuple(table.headings[i] for i in kept),
        units=None if table.units is None else tuple(units[i] for i in kept),
        columns=tuple(table.columns[i] for i in kept),
        notes=(*table.notes, note),
    )


def check_width(table: RawTable) -> None:
    """Raise ColumnError for a table of more columns than any test rig has, whose inspection would take minutes."""
    if len(table.headings) > MAX_COLUMNS:
        raise ColumnError(
            f"{table.origin}: the table has {len(table.headings)} columns; at most {MAX_COLUMNS} are read. Export the "
            "needed columns alone."
        )


def _equal(one: Cells, other: Cells) -> bool:
    if isinstance(one, list) or isinstance(other, list):
        return isinstance(one, list) and isinstance(other, list) and one == other
    return bool(np.array_equal(one, other, equal_nan=True))


def check_unique(table: RawTable, headings: Sequence[Heading]) -> None:
    """Raise ColumnError where several columns contain one quantity, as two tables side by side do."""
    numbers: dict[str, list[int]] = {}
    for i, heading in enumerate(headings):
        if heading.text:
            numbers.setdefault(heading.name, []).append(i + 1)
    several = {name: own for name, own in numbers.items() if len(own) > 1}
    if len(several) > 1:
        places = "; ".join(f"{name}: columns {' and '.join(map(str, own))}" for name, own in several.items())
        raise ColumnError(
            f"{table.origin}: {len(several)} quantities are in several columns ({places}), as in two tables side by "
            "side. Write each table to a sheet or a file of its own; for several muscles, write 'left.pressure' and "
            "'right.pressure'."
        )
    for name, own in several.items():
        first, second = (headings[i - 1].text for i in own[:2])
        raise ColumnError(
            f"{table.origin}: columns '{first}' and '{second}' (numbers {own[0]} and {own[1]}) both contain the "
            f"{name}. Rename or delete one of them; for several muscles, write 'left.{name}' and 'right.{name}'."
        )
