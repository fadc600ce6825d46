"""Options with which a command changes an entry of the library."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from ...core import check_known, leaves, quantity, with_parameters
from ...files import library
from ...files.library import PARTS, Entry, load_law
from ..requests import many, optional, read_pair, request


@request
class EntryRequest:
    """How an entry differs from its file."""

    resting_length: str | None = optional(
        "Scale the muscle to this resting length: '200 mm'.", metavar="QUANTITY"
    )
    diameter: str | None = optional(
        "Scale a McKibben muscle to this braid diameter at rest.", metavar="QUANTITY"
    )
    set: tuple[Any, ...] = many(
        "Another value of a parameter, by its path: characteristic.slope_factor=2,"
        " 'geometry.radius=10 mm'. Repeatable.",
        metavar="PATH=VALUE",
        read=read_pair,
    )

    def load(self, name: str, find: Callable[[str], Any] = load_law) -> Any:
        """The entry of a name or file, as changed. Raises ParameterError or UnitError."""
        entry = find(name)
        if self.resting_length is not None or self.diameter is not None:
            entry = library.scale_entry(
                entry, resting_length=self.resting_length, diameter=self.diameter
            )
        return with_values(entry, dict(self.set))


def with_values(entry: Any, changes: Mapping[str, float | str]) -> Any:
    """The entry with other values, [SI] or texts, by path; a law loses standard errors, error band
    and checks.
    """
    if not changes:
        return entry
    parts = {name: part for name in PARTS if (part := getattr(entry, name, None)) is not None}
    known = {f"{name}.{leaf.path}": leaf for name, part in parts.items() for leaf in leaves(part)}
    check_known(f"{entry.name} has no parameter", changes, known, "its parameters are")
    values = {
        path: quantity(value, known[path].declared.unit, where=path)
        for path, value in changes.items()
    }
    changed = {
        name: with_parameters(
            part, [values.get(f"{name}.{leaf.path}", leaf.value) for leaf in leaves(part)]
        )
        for name, part in parts.items()
        if any(path.startswith(f"{name}.") for path in values)
    }
    geometry = getattr(parts.get("characteristic"), "geometry", None)
    if "characteristic" in changed and geometry is not None and geometry == entry.geometry:
        changed["geometry"] = changed["characteristic"].geometry
    if not isinstance(entry, Entry):
        return dataclasses.replace(entry, **changed)
    stated = ", ".join(f"{path} = {value:.6g}" for path, value in values.items())
    return dataclasses.replace(
        entry,
        **changed,
        title=f"{entry.title}, parameters changed",
        provenance="chosen",
        uncertainty=None,
        checks=(),
        error_band=None,
        note=f"Changed (SI): {stated}. {entry.note}".strip(),
    )
