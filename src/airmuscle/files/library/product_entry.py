"""Entries of the library that are commercial muscles, without a law."""

import dataclasses
from collections.abc import Iterator

from ...core import Reference
from ...physics.muscle import Ratings
from ...report.chapter import Table
from .entry_display import EntryDisplay
from .files import entries_of_product


@dataclasses.dataclass(frozen=True, repr=False)
class ProductEntry(EntryDisplay):
    """Library entry of a commercial muscle: the values that its maker permits [SI], with provenance
    and sources.

    It has no characteristic; the file of a muscle or a law that was measured on this product refers
    to it, `product = "festo-dmsp-20"`, or has a table [ratings] of its own.
    """

    ratings: Ratings
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})

    def tables(self) -> Iterator[Table]:
        """The permitted ranges, and the muscles and laws that were measured on the product."""
        rows = list(self.ratings.ranges())
        columns = {"permitted": [row.quantity for row in rows], "range": list(map(str, rows))}
        yield Table("permitted", "Permitted ranges", columns)
        laws = entries_of_product(self.name)
        yield Table(
            "laws", "Muscles and laws of this product", {"law": list(laws)}, brief=len(laws)
        )

    def remarks(self) -> Iterator[str]:
        if not entries_of_product(self.name):
            yield "No law of it is published; fit one to measurements."
