"""Downsampling of very long recordings, reported in a note, and reading of long columns by pieces."""

import abc
import dataclasses
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import ColumnError, ParameterError, check_field_types
from ...recording.recording import RowNote
from .channels import Cells, RawTable


@dataclasses.dataclass(frozen=True)
class Downsampling(abc.ABC):
    """Reduction of a longer file to at most `max_rows` rows."""

    max_rows: int = 2_000_000

    def __post_init__(self) -> None:
        check_field_types(self)
        if self.max_rows < 1:
            raise ParameterError(f"max_rows is {self.max_rows}; it must be at least 1.")

    def step(self, rows: int) -> int:
        """The number of rows that are reduced to one."""
        return max(1, math.ceil(rows / self.max_rows))

    @abc.abstractmethod
    def reduce(self, cells: Cells, step: int) -> Cells:
        """The column with one row for every `step` rows."""

    @abc.abstractmethod
    def note(self, rows: int, step: int) -> str:
        """The note for the user on the reduction of `rows` rows."""


class Decimation(Downsampling):
    """Every n-th row as measured: resolution and saturation of the sensors are preserved, noise is not averaged."""

    def reduce(self, cells: Cells, step: int) -> Cells:
        return cells[::step]

    def note(self, rows: int, step: int) -> str:
        kept = math.ceil(rows / step)
        return RowNote(f"The file has {rows} rows; one in {step} is kept as measured, {kept} in total (max_rows).")


class BlockMeans(Downsampling):
    """Means over blocks of n rows: noise is averaged, outliers are smeared, saturation and resolution are lost.

    A text, such as a clock time, is that of the middle row of its block.
    """

    def reduce(self, cells: Cells, step: int) -> Cells:
        starts = np.arange(0, len(cells), step)
        sizes: npt.NDArray[np.int64] = np.diff(np.append(starts, len(cells)))
        if isinstance(cells, list):
            return [cells[row] for row in (starts + (sizes - 1) // 2).tolist()]
        return np.asarray(np.add.reduceat(cells, starts) / sizes, dtype=float)

    def note(self, rows: int, step: int) -> str:
        kept = math.ceil(rows / step)
        replaced = f"each block of {step} is replaced by its mean, {kept} in total (max_rows)"
        return RowNote(f"The file has {rows} rows; {replaced}.")


def downsample(table: RawTable, downsampling: Downsampling) -> RawTable:
    """The table with at most `downsampling.max_rows` rows, and a note if it was reduced."""
    step = downsampling.step(len(table.rows))
    if step == 1:
        return table
    return dataclasses.replace(
        table,
        columns=tuple(downsampling.reduce(cells, step) for cells in table.columns),
        rows=table.rows[::step],
        notes=(*table.notes, downsampling.note(len(table.rows), step)),
    )


PIECE_ROWS = 500_000
"""Number of rows that are read at once (chosen): 4 MB of a column of numbers."""


@dataclasses.dataclass(frozen=True)
class Reduction:
    """The number of rows of a table in its file, and the number of rows that are reduced to one."""

    rows: int
    step: int

    @classmethod
    def of(cls, sizes: Iterable[int], downsampling: Downsampling) -> "Reduction":
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
