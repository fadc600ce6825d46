"""Downsampling of very long recordings, reported in a note."""

from __future__ import annotations

import abc
import dataclasses
import math

import numpy as np
import numpy.typing as npt

from ...core.annotation import check_field_types
from ...core.errors import ParameterError
from ...recording.recording import RowNote
from .table import Cells, RawTable


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
