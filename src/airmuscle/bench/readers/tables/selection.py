"""Selection of what is read from a file."""

import dataclasses
from collections.abc import Iterable

from ....core import FileError, alternatives
from .text_format import TextFormat
from .time_base import Decimation, Downsampling


@dataclasses.dataclass(frozen=True)
class Selection:
    """What a user wants of a file, and says of its form.

    group         group, struct or topic; several are separated by commas
    sheet         worksheet of a workbook
    columns       names of the columns that are mapped
    text_format   of text files
    downsampling  reduction of very long tables
    """

    group: str | None = None
    sheet: str | None = None
    columns: tuple[str, ...] = ()
    text_format: TextFormat = TextFormat()
    downsampling: Downsampling = Decimation()

    def groups(self, origin: str, kind: str, names: Iterable[str]) -> tuple[str, ...]:
        """The selected ones among the names of groups, in their order in the file; all of them if
        none is selected. `kind` is their word in messages. Raises FileError for an unknown name.
        """
        known = {name.strip("/"): name for name in names}
        if self.group is None:
            return tuple(known.values())
        complete_name = self.group.strip("/")
        # a name may contain a comma itself
        wanted = (
            [complete_name]
            if complete_name in known
            else [_bare(part) for part in self.group.split(",")]
        )
        for name in wanted:
            if name not in known:
                there = alternatives(name, tuple(known.values()), f"the {kind}s are")
                raise FileError(f"{origin}: no {kind} '{name}'{there}")
        return tuple(name for bare, name in known.items() if bare in wanted)


def _bare(text: str) -> str:
    return text.strip().strip("/")
