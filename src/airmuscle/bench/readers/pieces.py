"""Reading by pieces: long columns of binary files, reduced while they are read, so that memory use is bounded."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ...core.errors import ColumnError
from .downsampling import Downsampling
from .table import RawTable

PIECE_ROWS = 500_000
"""Number of rows that are read at once (chosen): 4 MB of a column of numbers."""


@dataclasses.dataclass(frozen=True)
class Reduction:
    """The number of rows of a table in its file, and the number of rows that are reduced to one."""

    rows: int
    step: int

    @classmethod
    def of(cls, sizes: Iterable[int], downsampling: Downsampling) -> Reduction:
        """That of columns of these sizes, by the longest one."""
        longest = max(sizes, default=0)
        return cls(longest, downsampling.step(longest) if longest else 1)


def read_reduced(get: Callable[[int, int], Any], rows: int, step: int, downsampling: Downsampling) -> Any:
    """The rows of a column, or of the first axis of a matrix, with one for every `step` rows.

    `get(first, end)` returns the rows from `first` up to `end`, of which at most `PIECE_ROWS` are requested at once.
    """
    if step == 1:
        return get(0, rows)
    size = max(PIECE_ROWS // step, 1) * step
    parts = []
    for first in range(0, rows, size):
        piece = np.asarray(get(first, min(first + size, rows)))
        if piece.ndim == 1:
            parts.append(np.array(downsampling.reduce(piece, step)))
        else:
            parts.append(np.column_stack([downsampling.reduce(column, step) for column in piece.T]))
    return np.concatenate(parts)


def check_reduced_lengths(origin: str, full: Iterable[int], reduced: Iterable[int]) -> None:
    """Raise ColumnError where columns of different lengths have the same length after the reduction."""
    sizes = sorted(set(full))
    if len(sizes) != len(set(reduced)):
        raise ColumnError(
            f"{origin}: the columns have different lengths ({', '.join(map(str, sizes))} rows), which the reduction "
            "of the rows would hide. Store the columns of one length in a group of their own."
        )


def with_reduction(table: RawTable, reduction: Reduction, downsampling: Downsampling, of: str = "") -> RawTable:
    """The table of reduced columns with its row numbers and a note on the reduction; `of` begins the note."""
    if reduction.step == 1:
        return table
    rows = 1 + reduction.step * np.arange(len(table.rows))
    note = f"{of}{downsampling.note(reduction.rows, reduction.step)}"
    return dataclasses.replace(table, rows=rows, notes=(*table.notes, note))
