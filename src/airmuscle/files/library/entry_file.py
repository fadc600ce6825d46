"""Entries of the library by name, or from files of the same form: muscles and laws, valves, and products."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core import ParameterError, Reference, UnknownNameError
from ...physics.muscle.geometry.base import Geometry
from . import Location, entries_of_product, is_path, list_laws, located_errors, read_text, read_toml
from .build import build
from .entry import Entry, PlantEntry, ProductEntry, ValveEntry, issue_warning
from .files import FOLDERS, complete_name, list_names

NOUNS: Mapping[type[Any], str] = {
    ValveEntry: "valve", PlantEntry: "plant", ProductEntry: "product", Entry: "muscle or law",
}  # fmt: skip
"""Kinds of entries in words, which are those of their folders."""


def load_law(name_or_path: str | Path) -> Entry:
    """A muscle or a law by its name or a unique beginning of it, or its file by its path; as `load`, without valves."""
    tables, location = entry_tables(name_or_path, Entry)
    check_describes_law(tables, f"{location}: the file")
    entry: Entry = build_entry(tables, location)
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_valve(name_or_path: str | Path) -> ValveEntry:
    """A valve by its name or a unique beginning of it, or a valve file by its path.

    Raises UnknownNameError, FileError, ParameterError or UnitError with the location. A warning of the entry is issued
    as an AirmuscleWarning.
    """
    entry: ValveEntry = build_entry(*entry_tables(name_or_path, ValveEntry), ValveEntry)
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_product(name: str) -> ProductEntry:
    """A commercial muscle by its name or a unique beginning of it. Raises UnknownNameError."""
    entry: ProductEntry = build_entry(*tables_of_name(str(name), ProductEntry), ProductEntry)
    return entry


def entry_tables(name_or_path: str | Path, kind: type[Any] | None = None) -> tuple[dict[str, Any], Location]:
    """The tables of an entry of this kind, or of any, by name or path, and their location."""
    if is_path(name_or_path):
        path = Path(name_or_path)
        return read_toml(path), Location.of_file(path)
    return tables_of_name(str(name_or_path), kind)


def tables_of_name(name: str, kind: type[Any] | None) -> tuple[dict[str, Any], Location]:
    """The tables of the entry of this kind, or of any, with a name or a unique beginning of it, and their location."""
    if kind is Entry:
        _check_law_name(name)
    noun, folders = ("library entry", list(FOLDERS.values())) if kind is None else (NOUNS[kind], [FOLDERS[NOUNS[kind]]])
    known = {name: folder for folder in folders for name in list_names(folder)}
    name = complete_name(name, sorted(known), noun)
    return read_toml(known[name] / f"{name}.toml"), Location(f"{name}.toml", "", known[name])


def _check_law_name(name: str) -> None:
    """Raise UnknownNameError for the name of a valve, a plant or a product."""
    noun = next((noun for noun, folder in FOLDERS.items() if name in list_names(folder)), NOUNS[Entry])
    if noun == NOUNS[ProductEntry]:
        laws = entries_of_product(name)
        entries = f"its laws are {', '.join(laws)}" if laws else "no law of it is published; fit one to measurements"
        raise UnknownNameError(f"'{name}' is a product, of which the library states the permitted values; {entries}.")
    if noun != NOUNS[Entry]:
        raise UnknownNameError(f"'{name}' is a {noun}; a muscle or a law is required: {', '.join(list_laws())}.")


def kind_of(tables: Mapping[str, Any]) -> type[Any]:
    """The kind of the entry that tables describe."""
    if "characteristic" in tables:
        return Entry
    kinds = {"valve": ValveEntry, "plant": PlantEntry, "ratings": ProductEntry}
    return next((kind for table, kind in kinds.items() if table in tables), Entry)


def check_describes_law(tables: Mapping[str, Any], what: str) -> None:
    """Raise ParameterError unless tables describe a muscle or a law; `what` begins the message."""
    if (kind := kind_of(tables)) is not Entry:
        noun = "product without a law" if kind is ProductEntry else NOUNS[kind]
        raise ParameterError(f"{what} describes a {noun}; a muscle or a law is required.")


def build_entry(tables: Mapping[str, Any], location: Location, kind: type[Any] = Entry) -> Any:
    """The muscle, law, valve or product of the tables of a file.

    The ratings of an Entry are those of its `product` unless it states some. Raises UnknownNameError, FileError,
    ParameterError or UnitError with the location.
    """
    given: dict[str, Any] = {"name": Path(location.file).stem}
    cited: tuple[Reference, ...] = ()
    if kind is Entry and "product" in tables:
        if "ratings" in tables:
            raise ParameterError(
                f"{location}: both 'product' and [ratings] are given; the ratings of a product are in its own file. "
                "Remove one of them."
            )
        with located_errors(location):
            product = load_product(read_text(tables, "product", location, needed=True))
        given["ratings"], cited = product.ratings, product.references
        tables = {key: value for key, value in tables.items() if key != "product"}
    entry = build(tables, location, given, kind=kind)
    if kind is not Entry:
        return entry
    inside = getattr(entry.characteristic, "geometry", None)
    geometry = inside if entry.geometry is None and isinstance(inside, Geometry) else entry.geometry
    return dataclasses.replace(entry, geometry=geometry, references=(*entry.references, *cited))
