"""Entries by name or from files (muscles, laws, valves, products, plants), and data sets."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ... import bench, recording
from ...core import FileError, ParameterError, Reference, UnknownNameError
from ...physics.muscle.geometry.base import Geometry
from .. import library
from .build import build
from .entry import Entry, issue_warning
from .file_format import without_format
from .files import (
    Location,
    check_keys,
    complete_name,
    entries_of_product,
    is_path,
    located_errors,
    read_table,
    read_text,
    read_toml,
)
from .folders import DATA, FOLDERS, list_data, list_laws, list_names

LAW = "muscle or law"
CLASSES = {"valve": "ValveEntry", "plant": "PlantEntry", "product": "ProductEntry", LAW: "Entry"}
"""Classes of the entries, by what they are; the words are those of their folders."""
SCENARIO_TABLES: tuple[str, ...] = ("plant", "input", "run", "output")
"""Tables of a plant of the library that a scenario has, too."""


def load_law(name_or_path: str | Path) -> Entry:
    """A muscle or a law by its name or a unique beginning of it, or its file by its path; as
    `load`, without valves.
    """
    tables, location = entry_tables(name_or_path, LAW)
    check_describes_law(tables, f"{location}: the file")
    entry: Entry = build_entry(tables, location)
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_valve(name_or_path: str | Path) -> "library.ValveEntry":
    """A valve by its name or a unique beginning of it, or a valve file by its path; raises and
    warns as `load`.
    """
    entry: library.ValveEntry = build_entry(*entry_tables(name_or_path, "valve"), "valve")
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_muscle(name_or_path: str | Path) -> Entry:
    """A muscle by its name or a unique beginning of it, or its file by its path, whose `.muscle`
    can be simulated; raises and warns as `load`. Raises UnknownNameError for a law that is none.
    """
    tables, location = entry_tables(name_or_path, LAW)
    check_describes_law(tables, f"{location}: the file")
    entry: Entry = build_entry(tables, location)
    entry.check_is_muscle()
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_plant(name_or_path: str | Path) -> "library.PlantEntry":
    """A plant by its name or a unique beginning of it, or its file by its path; raises and warns as
    `load`.
    """
    entry: library.PlantEntry = build_entry(*entry_tables(name_or_path, "plant"), "plant")
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_product(name: str) -> "library.ProductEntry":
    """A commercial muscle by its name or a unique beginning of it. Raises UnknownNameError."""
    tables, location = _tables_of_name(str(name), "product")
    entry: library.ProductEntry = build_entry(tables, location, "product")
    return entry


def entry_tables(
    name_or_path: str | Path, kind: str | None = None
) -> tuple[dict[str, Any], Location]:
    """The tables of an entry of this kind, or of any, by name or path, and their location."""
    if is_path(name_or_path):
        path = Path(name_or_path)
        return read_toml(path), Location.of_file(path)
    return _tables_of_name(str(name_or_path), kind)


def _tables_of_name(name: str, kind: str | None) -> tuple[dict[str, Any], Location]:
    """The tables of the entry of this kind, or of any, with a name or a unique beginning of it, and
    their location.
    """
    if kind == LAW and name not in list_names(FOLDERS[LAW]):
        noun = next((noun for noun, folder in FOLDERS.items() if name in list_names(folder)), LAW)
        if noun == "product":
            laws = ", ".join(entries_of_product(name))
            entries = (
                f"its laws are {laws}"
                if laws
                else "no law of it is published; fit one to measurements"
            )
            what = f"'{name}' is a product, of which the library states the permitted values"
            raise UnknownNameError(f"{what}; {entries}.")
        if noun != LAW:
            raise UnknownNameError(
                f"'{name}' is a {noun}; a muscle or a law is required: {', '.join(list_laws())}."
            )
    noun, folders = (
        ("library entry", list(FOLDERS.values())) if kind is None else (kind, [FOLDERS[kind]])
    )
    known = {name: folder for folder in folders for name in list_names(folder)}
    name = complete_name(name, sorted(known), noun)
    return read_toml(known[name] / f"{name}.toml"), Location(f"{name}.toml", "", known[name])


def plant_tables(name: str) -> tuple[dict[str, Any], Location]:
    """The tables of a plant of the library, by its name or a unique beginning of it, and their
    location.
    """
    tables, location = _tables_of_name(name, "plant")
    issue_warning(Path(location.file).stem, tables.get("warning", ""), stacklevel=3)
    return tables, location


def kind_of(tables: Mapping[str, Any]) -> str:
    """The kind of the entry that tables describe: "muscle or law", "valve", "plant" or
    "product".
    """
    kinds = {"characteristic": LAW, "valve": "valve", "plant": "plant", "ratings": "product"}
    return next((kind for table, kind in kinds.items() if table in tables), LAW)


def check_describes_law(tables: Mapping[str, Any], what: str) -> None:
    """Raise ParameterError unless tables describe a muscle or a law; `what` begins the message."""
    if (kind := kind_of(tables)) != LAW:
        noun = "product without a law" if kind == "product" else kind
        raise ParameterError(f"{what} describes a {noun}; a muscle or a law is required.")


def build_entry(tables: Mapping[str, Any], location: Location, kind: str = LAW) -> Any:
    """The muscle, law, valve, product or plant of the tables of a file. The ratings of an Entry are
    those of its `product` unless it states some."""
    stated: dict[str, Any] = {"name": Path(location.file).stem}
    if kind == "plant":
        keys = (*SCENARIO_TABLES, "sources")
        place = location.inside("sources")
        check_keys(tables, ("title", "provenance", "note", "warning", *keys, "reference"), location)
        sources = read_table(tables.get("sources", {}), None, place, " of paths and sources")
        stated["plant"] = library.build_plant(tables["plant"], location.inside("plant"))
        stated["sources"] = tuple(
            (path, read_text(sources, path, place, needed=True)) for path in sources
        )
        tables = {key: value for key, value in tables.items() if key not in keys}
    cited: tuple[Reference, ...] = ()
    if kind == LAW:
        tables = without_format(tables, location)
    if kind == LAW and "product" in tables:
        if "ratings" in tables:
            raise ParameterError(
                f"{location}: both 'product' and [ratings] are given; the ratings of a product are"
                " in its own file. Remove one of them."
            )
        with located_errors(location):
            product = load_product(read_text(tables, "product", location, needed=True))
        stated["ratings"] = product.ratings
        cited = product.references
        tables = {key: value for key, value in tables.items() if key != "product"}
    entry = build(tables, location, stated, kind=getattr(library, CLASSES[kind]))
    if kind != LAW:
        return entry
    inside = getattr(entry.characteristic, "geometry", None)
    geometry = inside if entry.geometry is None and isinstance(inside, Geometry) else entry.geometry
    return dataclasses.replace(entry, geometry=geometry, references=(*entry.references, *cited))


def load_data(name: str) -> "recording.Recording":
    """A data set of the library by its name or a unique beginning of it.

    The last note of the Recording is the header of the file, with source and licence; `cite` gives
    its references.
    """
    path = DATA / f"{complete_name(str(name), list_data(), 'data set')}.csv"
    data_set: recording.Recording = bench.read_csv(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    header = " ".join(
        line.lstrip("# ") for line in lines if line.startswith("#") and " = " not in line
    )
    file = path.parent / "references.toml"
    sources = [
        source["reference"]
        for source in read_toml(file)["source"]
        if path.stem in source["data_sets"]
    ]
    if not sources:
        raise FileError(f"{file}: there is no source of the data set '{path.stem}'.")
    references = tuple(Reference(**reference) for reference in sources[0])
    return dataclasses.replace(data_set, notes=(*data_set.notes, header), references=references)
