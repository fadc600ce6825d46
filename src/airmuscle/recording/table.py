"""A table as a file holds it: headings and cells, before anyone knows what they mean.

Every reader of a file format ends here, and `interpret` begins here; only this stands between the two.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

Cells = npt.NDArray[np.float64] | list[str]
"""A column: numbers where the reader found nothing else, otherwise its texts."""


@dataclasses.dataclass(frozen=True, eq=False)
class RawTable:
    """Columns that share their rows, each with its heading, and where every row stands in the file.

    `units` is a row of units below the headings, where there is one; `remarks` are what the file states in its
    comments (resting_length, specimen). A row is called `row_word` and its number in messages: "line 41".
    """

    origin: str
    headings: tuple[str, ...]
    units: tuple[str, ...] | None
    columns: tuple[Cells, ...]
    rows: npt.NDArray[np.int64]
    row_label: str = "line"
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def location(self, row: int) -> str:
        """Where a row stands, to open a message with: `bench.csv, line 41`."""
        return f"{self.origin}, {self.row_label} {self.rows[row]}"
