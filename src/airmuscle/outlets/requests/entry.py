"""Request of a variant of a library entry: another size, other parameter values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...files.library.changes import with_values
from ...files.library.entry_file import load_law
from ...files.library.scaling import scale_entry
from .declaration import option, request
from .reading import read_pair


@request
class EntryRequest:
    """How an entry differs from its file."""

    resting_length: str | None = option(
        "Scale the muscle to this resting length: '200 mm'.", default=None, metavar="QUANTITY"
    )
    diameter: str | None = option(
        "Scale a McKibben muscle to this braid diameter at rest.", default=None, metavar="QUANTITY"
    )
    set: tuple[Any, ...] = option(
        "Another value of a parameter, by its path: characteristic.slope_factor=2, 'geometry.radius=10 mm'. "
        "Repeatable.",
        default=(),
        metavar="PATH=VALUE",
        read=read_pair,
    )

    def load(self, name: str, find: Callable[[str], Any] = load_law) -> Any:
        """The entry of a name or file, as changed. Raises ParameterError or UnitError."""
        entry = find(name)
        if self.resting_length is not None or self.diameter is not None:
            entry = scale_entry(entry, resting_length=self.resting_length, diameter=self.diameter)
        return with_values(entry, dict(self.set))
