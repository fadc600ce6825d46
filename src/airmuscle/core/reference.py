"""Where a formula or a number comes from, and how to ask any object for its sources."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from .errors import ParameterError


@dataclasses.dataclass(frozen=True)
class Reference:
    """A paper, standard or data source; `note` says what was taken from where, or how far to trust it."""

    key: str
    authors: str
    title: str
    where: str
    year: int | None = None
    doi: str | None = None
    note: str = ""

    def __str__(self) -> str:
        year = f" ({self.year})" if self.year else " (undated)"
        doi = f", doi:{self.doi}" if self.doi else ""
        note = f" [{self.note}]" if self.note else ""
        return f'{self.authors}{year}: "{self.title}", {self.where}{doi}.{note}'


CHOSEN = "chosen"
"""The source of a number that no paper prints."""


def _walk(thing: Any) -> Iterator[Reference]:
    yield from getattr(thing, "references", ())
    if dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        for field in dataclasses.fields(thing):
            yield from _walk(getattr(thing, field.name))
    elif isinstance(thing, tuple | list):
        for item in thing:
            yield from _walk(item)


def cite(thing: Any) -> list[Reference]:
    """Every source used by `thing`, found by walking its fields, each once, sorted by key.

    `thing` is any noun of airmuscle: a law, a muscle, a plant, a fit, a library entry, or a tuple of them. Raises
    ParameterError for anything else, as a name is.
    """
    if not (dataclasses.is_dataclass(thing) or isinstance(thing, tuple | list) or hasattr(thing, "references")):
        raise ParameterError(f"cite: {thing!r} is no model; load an entry by its name: cite(load('dmsp-20-300')).")
    found = {reference.key: reference for reference in _walk(thing)}
    return [found[key] for key in sorted(found)]
