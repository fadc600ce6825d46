"""Entries of the library that are plants."""

import dataclasses
from typing import Any

from ...core import Reference
from ...physics import Plant
from .entry_display import EntryDisplay


@dataclasses.dataclass(frozen=True, repr=False)
class PlantEntry(EntryDisplay):
    """Plant of the library, all numbers SI; its file has the tables of a scenario, and the source
    of each number.

    `sources` are pairs of a path in the file, such as mechanism.radius, and the source of the
    numbers under it: "chosen" if no publication states them.
    """

    plant: Plant
    sources: tuple[tuple[str, str], ...] = ()
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})

    def chart(self) -> Any:
        return self.plant._card().draw
