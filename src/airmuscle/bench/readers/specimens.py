"""Division of a table by its column `specimen`: the runs of several muscles in one file."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from .table import Cells, RawTable

SPECIMEN = "specimen"
"""Heading of the column that names the specimen of each row."""
MAX_SPECIMENS = 100
"""Maximum number of specimens of a file (chosen); one with more values, such as row numbers, names none."""


def split_specimens(table: RawTable) -> tuple[RawTable, ...]:
    """The tables of the specimens that the column `specimen` names, each with the constant `specimen`.

    The table itself without such a column, or if it has more than `MAX_SPECIMENS` values.
    """
    names = [heading.strip().lower() for heading in table.headings]
    if names.count(SPECIMEN) != 1:
        return (table,)
    column = names.index(SPECIMEN)
    labels = label_texts(table.columns[column])
    values = list(dict.fromkeys(labels.tolist()))
    if not 0 < len(values) <= MAX_SPECIMENS:
        return (table,)
    return tuple(_part(table, column, value, labels == value, len(values)) for value in values)


def label_texts(cells: Cells) -> npt.NDArray[np.str_]:
    """The cells of a column as texts (N,); whole numbers without decimals."""
    return np.array([cell.strip() if isinstance(cell, str) else f"{cell:g}" for cell in cells], dtype=str)


def _part(table: RawTable, column: int, value: str, rows: npt.NDArray[np.bool_], count: int) -> RawTable:
    kept = [i for i in range(len(table.headings)) if i != column]
    chosen = np.flatnonzero(rows)
    cells = [table.columns[i] for i in kept]
    return dataclasses.replace(
        table,
        origin=table.origin if count == 1 else f"{table.origin}, specimen {value}",
        headings=tuple(table.headings[i] for i in kept),
        units=tuple(table.units[i] for i in kept if i < len(table.units)) if table.units else None,
        columns=tuple([each[i] for i in chosen] if isinstance(each, list) else each[chosen] for each in cells),
        rows=table.rows[chosen],
        constants={**table.constants, SPECIMEN: value},
    )
