"""Base of the entries of the library: what all of them state, and their description."""

import abc
import dataclasses
from collections.abc import Iterator
from typing import Any

from ...bench.reported import Reported
from ...core import ParameterError, check_field_types, one_line, suggestion
from ...report.chapter import Chapter, Table
from .. import library

PARTS = (
    "characteristic",
    "geometry",
    "spring",
    "damper",
    "friction",
    "wall",
    "series",
    "stop",
    "creep",
    "ratings",
    "validity_range",
    "valve",
    "exhaust",
    "switching_times",
    "plant",
)
"""Components of an entry, in the order in which they are described."""
PROVENANCES = (
    "printed",
    "corrected",
    "converted",
    "measured",
    "data sheet",
    "secondary source",
    "fitted",
    "chosen",
    "example",
)
"""Words for the origin of the numbers of an entry."""


@dataclasses.dataclass(frozen=True, repr=False)
class EntryDisplay(Reported, abc.ABC):
    """Base of the library entries: what all of them state, the check of their fields, and their
    description.

    `provenance` is the origin of the numbers, words of PROVENANCES between commas, `note` what was
    published and how it was converted, `warning` a restriction of use, which is issued when the
    entry is loaded.
    """

    name: str = dataclasses.field(metadata={"key": ""})
    title: str
    provenance: str
    _: dataclasses.KW_ONLY
    note: str = ""
    warning: str = ""

    def __post_init__(self) -> None:
        check_field_types(self)
        for word in map(str.strip, self.provenance.split(",")):
            if word not in PROVENANCES:
                raise ParameterError(
                    f"provenance is '{one_line(word)}'; allowed are {', '.join(PROVENANCES)},"
                    f" several between commas.{suggestion(word, PROVENANCES)}"
                )

    def chapter(self) -> Chapter:
        """The description of the entry."""
        return library.entry_chapter(self)

    @property
    def grade(self) -> str:
        """Whose numbers these are: a table of the maker, a secondary source, who measured, who
        submitted.
        """
        return library.grade_of(vars(self))

    def tables(self) -> Iterator[Table]:
        """Tables besides components, parameters, checks and sources."""
        return iter(())

    def remarks(self) -> Iterator[str]:
        """Remarks besides the note of the entry."""
        return iter(())

    def chart(self) -> Any:
        """Function that draws the chart, or None."""
        return None
