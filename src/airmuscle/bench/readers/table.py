"""RawTable: headings and cells of a file before interpretation.

Every file reader returns RawTables, and `interpret` converts them to Recordings.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

Cells = npt.NDArray[np.float64] | list[str]
"""A column: numbers if the reader found only numbers, otherwise texts."""


@dataclasses.dataclass(frozen=True, eq=False)
class RawTable:
    """Columns with common rows, their headings, and the number of each row in the file.

    `units` is the unit row below the headings, if any; `constants` are those stated in the comments of the file
    (resting_length, specimen). `row_label` names a row in messages: "line 41".
    """

    origin: str
    headings: tuple[str, ...]
    units: tuple[str, ...] | None
    columns: tuple[Cells, ...]
    rows: npt.NDArray[np.int64]
    row_label: str = "line"
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()
    fields: frozenset[str] = frozenset()
    """Headings that are names of fields of a message and state no quantity."""

    def location(self, row: int) -> str:
        """The location of a row in the file, for messages: `bench.csv, line 41`."""
        return f"{self.origin}, {self.row_label} {self.rows[row]}"
