"""Plants from TOML tables: the table [plant] of a scenario, and the plants of the library.

A plant of the library is a file of the same form as a scenario, with its provenance and the source of each number:

    title = "..."                   what it is
    provenance = "chosen"           origin of the numbers
    [plant]                         muscles, circuits, mechanism and gas, as in a scenario
    [input]                         the input signal of the example run, as in a scenario
    [run]                           duration and initial state of the example run
    [sources]                       source of each number of the tables, by its path or the beginning of its path
    [[reference]]                   references
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import NoneType
from typing import Any

from ...core.errors import ParameterError
from ...core.reference import Reference
from ...physics.muscle import Muscle
from ...physics.muscle.characteristic.base import ForceLaw
from ...physics.plant.plant import Plant
from .build import TEXT_KEYS, build, read_entry_texts
from .entry import MISSING_GEOMETRY, Entry, issue_warning
from .entry_display import EntryDisplay
from .files import PLANTS, complete_name, list_plants, read_toml
from .law_file import load_law
from .location import Location, check_keys, check_type, located_errors, read_finite_number, read_text
from .references import read_references
from .scaling import scale_entry

SCENARIO_TABLES = ("plant", "input", "run", "output")
"""Tables of a plant of the library that a scenario has, too."""
KEYS = (*TEXT_KEYS, *SCENARIO_TABLES, "sources", "reference")
"""Keys of the file of a plant."""


SIZES = ("resting_length", "diameter")
"""Sizes to which a table that names a library entry may scale its muscle."""


@dataclasses.dataclass(frozen=True, repr=False)
class PlantEntry(EntryDisplay):
    """Plant of the library, all numbers SI.

    `sources` are pairs of a path in the file, such as mechanism.radius, and the source of the numbers under it:
    "chosen" if no publication states them. `warning` is issued when the plant is loaded.
    """

    name: str
    title: str
    provenance: str
    plant: Plant
    note: str = ""
    warning: str = ""
    sources: tuple[tuple[str, str], ...] = ()
    references: tuple[Reference, ...] = ()

    def _table(self) -> list[tuple[str, ...]]:
        return [tuple(row) for row in self.plant._card().table]

    def _chart(self) -> Any:
        return self.plant._card().draw


def build_plant_entry(tables: Mapping[str, Any], name: str, file: Path, folder: Path) -> PlantEntry:
    """The entry of the tables of a file; error messages name `file`, data files are relative to `folder`.

    Raises FileError, ParameterError, UnitError or UnknownNameError with the location.
    """
    location = Location(str(file), "", folder)
    check_keys(tables, KEYS, location)
    sources, in_sources = tables.get("sources", {}), location.inside("sources")
    if not isinstance(sources, Mapping):
        raise ParameterError(f"{in_sources} is {sources!r}; it must be a table of paths and sources.")
    pairs = tuple((path, read_text(sources, path, in_sources, needed=True)) for path in sources)
    texts, plant = read_entry_texts(tables, location), build_plant(tables["plant"], location.inside("plant"))
    return PlantEntry(name, plant=plant, sources=pairs, references=read_references(tables, location), **texts)


def plant_tables(name: str) -> tuple[dict[str, Any], Location]:
    """The tables of a plant of the library, by its name or a unique beginning of it, and their location.

    Its warning is issued as an AirmuscleWarning. Raises UnknownNameError.
    """
    path = PLANTS / f"{complete_name(name, list_plants(), 'plant')}.toml"
    tables = read_toml(path)
    issue_warning(path.stem, tables.get("warning", ""), stacklevel=2)
    return tables, Location(path.name, "", path.parent)


def _with_library_plant(table: Mapping[str, Any], location: Location) -> dict[str, Any]:
    """The table of a plant of the library, with the parts that `table` replaces."""
    inner = location.inside("library")
    if not isinstance(table["library"], str):
        raise ParameterError(f"{inner} is {table['library']!r}; name a plant of the library.")
    with located_errors(inner):
        tables, _ = plant_tables(table["library"])
    return {**tables["plant"], **{key: value for key, value in table.items() if key != "library"}}


def build_plant(table: Mapping[str, Any], location: Location) -> Plant:
    """The plant of a table [plant]. Raises FileError, ParameterError, UnitError or UnknownNameError."""
    if "library" in table:
        table = _with_library_plant(table, location)
    value = table.get("muscle")
    if value is None:
        raise ParameterError(
            f"{location}: 'muscle' is missing; name a library entry or a muscle file, or write [plant.muscle]."
        )
    muscle: Muscle | tuple[Muscle, ...]
    if isinstance(value, list):
        muscle = tuple(build_muscle(item, location.inside(f"muscle[{i}]")) for i, item in enumerate(value))
    else:
        muscle = build_muscle(value, location.inside("muscle"))
    others = {"model": "Plant", **{key: item for key, item in table.items() if key != "muscle"}}
    plant: Plant = check_type(build(others, location, {"muscle": muscle}), Plant, location)
    return plant


def build_muscle(value: Any, location: Location) -> Muscle:
    """The muscle of a library name, a file or a table. Raises FileError, ParameterError, UnitError or
    UnknownNameError."""
    if isinstance(value, Mapping):
        table = {"model": "Muscle", **value}
        name = table.pop("library", None)
        parts = {} if name is None else _entry_parts(_load_scaled(name, table, location), table, location)
        muscle: Muscle = build(table, location, parts)
        return muscle
    entry = _load_entry(value, location)
    with located_errors(location):
        return entry.muscle


def _load_scaled(name: Any, table: dict[str, Any], location: Location) -> Entry:
    """The entry of this name, scaled to the sizes of the table, which are removed from it."""
    entry = _load_entry(name, location.inside("library"))
    sizes = {key: read_finite_number(table.pop(key), "m", f"{location}, {key}") for key in SIZES if key in table}
    with located_errors(location):
        return scale_entry(entry, **sizes)


def _load_entry(value: Any, location: Location) -> Entry:
    if not isinstance(value, str):
        raise ParameterError(f"{location} is {value!r}; name a library entry or a muscle file.")
    with located_errors(location):
        return load_law(location.folder / value if value.endswith(".toml") else value)


def _entry_parts(entry: Entry, replaced: Mapping[str, Any], location: Location) -> dict[str, Any]:
    """Parts of an entry that a table does not replace; the table may add missing parts, such as a geometry."""
    names = [f.name for f in dataclasses.fields(Muscle) if f.name not in ("contractile", "name")]
    parts = {"contractile": entry.characteristic, **{name: getattr(entry, name, None) for name in names}}
    if "contractile" in replaced:
        del parts["validity_range"]  # it belongs to the replaced law
    kept = {name: part for name, part in parts.items() if part is not None and name not in replaced}
    if not isinstance(kept.get("contractile"), ForceLaw | NoneType):
        raise ParameterError(
            f"{location}: {entry.name} is {type(entry.characteristic).__name__}, which is not solved for the force; "
            "a plant needs a ForceLaw. In Python, as_force_law(law, validity range) makes one."
        )
    if "geometry" not in {*kept, *replaced}:
        raise ParameterError(f"{location}: {entry.name} lacks {MISSING_GEOMETRY}.")
    return kept
