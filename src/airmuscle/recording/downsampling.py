"""Making do with fewer rows of a very long recording, and saying so."""

from __future__ import annotations

import abc
import dataclasses
import math

import numpy as np
import numpy.typing as npt

from ..core.errors import ParameterError
from .table import Cells, RawTable


@dataclasses.dataclass(frozen=True)
class Downsampling(abc.ABC):
    """At most `most_rows` rows are kept of a file that has more."""

    max_rows: int = 2_000_000

    def __post_init__(self) -> None:
        if self.max_rows < 1:
            raise ParameterError(f"most_rows is {self.max_rows}; it must be 1 or more.")

    def step(self, rows: int) -> int:
        """How many rows become one."""
        return max(1, math.ceil(rows / self.max_rows))

    @abc.abstractmethod
    def column(self, cells: Cells, step: int) -> Cells:
        """A column with one row for every `step`."""

    @abc.abstractmethod
    def note(self, rows: int, step: int) -> str:
        """What the reader should know of it."""


class Decimation(Downsampling):
    """Every n-th row as it was measured: resolution and ends of the sensors stay visible, noise is not averaged."""

    def column(self, cells: Cells, step: int) -> Cells:
        return cells[::step]

    def note(self, rows: int, step: int) -> str:
        kept = math.ceil(rows / step)
        return f"The file has {rows} rows; one in {step} is kept as measured, {kept} in all (most_rows)."


class BlockMeans(Downsampling):
    """Means of n rows: noise becomes less, glitches smear, clipping and resolution are no longer visible."""

    def column(self, cells: Cells, step: int) -> Cells:
        if isinstance(cells, list):
            return cells[::step]
        starts = np.arange(0, len(cells), step)
        sizes: npt.NDArray[np.int64] = np.diff(np.append(starts, len(cells)))
        return np.asarray(np.add.reduceat(cells, starts) / sizes, dtype=float)

    def note(self, rows: int, step: int) -> str:
        kept = math.ceil(rows / step)
        return f"The file has {rows} rows; each {step} are replaced by their mean, {kept} in all (most_rows)."


def downsample(table: RawTable, thinning: Downsampling) -> RawTable:
    """The table with no more rows than the thinning allows."""
    step = thinning.step(len(table.rows))
    if step == 1:
        return table
    return dataclasses.replace(
        table,
        columns=tuple(thinning.column(cells, step) for cells in table.columns),
        rows=table.rows[::step],
        notes=(*table.notes, thinning.note(len(table.rows), step)),
    )
