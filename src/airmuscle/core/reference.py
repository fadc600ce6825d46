"""References of formulas and numbers; `cite` collects the references of an object."""

import dataclasses
import functools
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .annotation import check_field_types, is_model
from .errors import ParameterError


@dataclasses.dataclass(frozen=True)
class Reference:
    """A paper, standard or data source.

    `where` is the journal, proceedings, report or standard; `note` states what was taken from it,
    and its reliability.
    """

    key: str
    authors: str
    title: str
    where: str
    year: int | None = None
    doi: str | None = None
    note: str = ""

    def __post_init__(self) -> None:
        check_field_types(self)

    def __str__(self) -> str:
        year = f" ({self.year})" if self.year else " (undated)"
        doi = f", doi:{self.doi}" if self.doi else ""
        note = f" [{self.note}]" if self.note else ""
        return f'{self.authors}{year}: "{self.title}", {self.where}{doi}.{note}'


@functools.cache
def _bibliography() -> Mapping[str, Mapping[str, Any]]:
    text = Path(__file__).with_name("references.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def published(key: str, note: str = "") -> Reference:
    """The reference of a key in `references.json`, the bibliography of the program; `note` replaces
    its note.
    """
    entry = Reference(key, **_bibliography()[key])
    return dataclasses.replace(entry, note=note or entry.note)


CHOSEN = "chosen"
"""Label of a number that no paper prints."""


def _walk(obj: Any) -> Iterator[Reference]:
    """Yield the references of an object and of its fields, with repetitions."""
    if isinstance(obj, Reference):
        yield obj
        return
    yield from getattr(obj, "references", ())
    if is_model(obj):
        for field in dataclasses.fields(obj):
            yield from _walk(getattr(obj, field.name))
    elif isinstance(obj, tuple | list):
        for item in obj:
            yield from _walk(item)


def cite(obj: Any) -> list[Reference]:
    """Return the references of an object and of all its components, without repetitions, sorted by
    key.

    `obj` is any object of airmuscle: a characteristic, a muscle, a plant, a fit, a recording, a
    library entry, or a tuple of them. Recordings have the references of a published data set, or of
    the models of a simulation. Raises ParameterError for anything else, such as a name.
    """
    if not (
        dataclasses.is_dataclass(obj) or isinstance(obj, tuple | list) or hasattr(obj, "references")
    ):
        raise ParameterError(
            f"cite: {obj!r} is not a model; load a library entry by its name:"
            " cite(load('dmsp-20-300'))."
        )
    by_key = {reference.key: reference for reference in _walk(obj)}
    return [by_key[key] for key in sorted(by_key)]
