"""Plants from TOML tables: the table [plant] of a scenario, and the plants of the library; entries of any kind by name.

A plant of the library is a file of the same form as a scenario, with its provenance, and in [sources] the source of
each number of the tables, by its path or the beginning of its path. Parts of a plant may be named: a muscle and a plant
of the library or of a file, and an orifice or a driver with the values of a valve, `{ library = "matrix-821" }`; of a
muscle and of a plant the other keys replace parts.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import NoneType
from typing import Any

from ...bench.readers import read_csv
from ...core import FileError, ParameterError, Reference, abridged
from ...engine.loop.pwm_and_solenoid import Driver, SolenoidDriver
from ...physics import ForceLaw, Muscle, Orifice, Plant
from ...recording import Recording
from . import Location, check_keys, list_data, located_errors, read_finite_number, read_table, read_text, read_toml
from .build import TableReader, build
from .entry import MISSING_GEOMETRY, PATHS, AnyEntry, Entry, PlantEntry, ValveEntry, issue_warning
from .entry_file import build_entry, entry_tables, kind_of, load_law, load_valve, tables_of_name
from .files import DATA, complete_name
from .scaling import scale_entry

SCENARIO_TABLES: tuple[str, ...] = ("plant", "input", "run", "output")
"""Tables of a plant of the library that a scenario has, too."""
SIZES = ("resting_length", "diameter")
"""Sizes to which a table that names a library entry may scale its muscle."""


def build_plant_entry(tables: Mapping[str, Any], location: Location) -> PlantEntry:
    """The entry of the tables of a file. Raises FileError, ParameterError, UnitError or UnknownNameError."""
    keys = ("title", "provenance", "note", "warning", *SCENARIO_TABLES, "sources", "reference")
    check_keys(tables, keys, location)
    in_sources = location.inside("sources")
    sources = read_table(tables.get("sources", {}), None, in_sources, " of paths and sources")
    given = {
        "name": Path(location.file).stem,
        "plant": build_plant(tables["plant"], location.inside("plant")),
        "sources": tuple((path, read_text(sources, path, in_sources, needed=True)) for path in sources),
    }
    own = {key: value for key, value in tables.items() if key not in (*SCENARIO_TABLES, "sources")}
    entry: PlantEntry = build(own, location, given, kind=PlantEntry)
    return entry


def plant_tables(name: str) -> tuple[dict[str, Any], Location]:
    """The tables of a plant of the library, by its name or a unique beginning of it, and their location.

    Its warning is issued as an AirmuscleWarning. Raises UnknownNameError.
    """
    tables, location = tables_of_name(name, PlantEntry)
    issue_warning(Path(location.file).stem, tables.get("warning", ""), stacklevel=3)
    return tables, location


def build_plant(table: Any, location: Location) -> Plant:
    """The plant of a table [plant]. Raises FileError, ParameterError, UnitError or UnknownNameError."""
    plant: Plant = PLANT_READER.build(table, location, kind=Plant)
    return plant


def build_muscle(value: Any, location: Location) -> Muscle:
    """The muscle of a library name, a file or a table. Raises FileError, ParameterError, UnitError or
    UnknownNameError."""
    muscle: Muscle = PLANT_READER.build(value, location, kind=Muscle)
    return muscle


def _named_plant(table: Any, location: Location, reader: TableReader) -> Plant | None:
    """A plant of the library, with the parts that a table replaces."""
    if not isinstance(table, Mapping):
        return None
    if not {"library", "muscle"} & set(table):
        raise ParameterError(
            f"{location}: 'muscle' is missing; name a library entry or a muscle file, or write [plant.muscle]."
        )
    if "library" not in table:
        return None
    if not isinstance(table["library"], str):
        raise ParameterError(f"{location.inside('library')} is {abridged(table['library'])}; name a library plant.")
    with located_errors(location.inside("library")):
        tables, _ = plant_tables(table["library"])
    replaced = {key: value for key, value in table.items() if key != "library"}
    plant: Plant = reader.build({**tables["plant"], **replaced}, location, kind=Plant)
    return plant


def _named_muscle(value: Any, location: Location, reader: TableReader) -> Muscle | None:
    """A library entry or a muscle file, with the parts that a table replaces."""
    if not isinstance(value, Mapping):
        entry = _load_entry(value, location)
        with located_errors(location):
            return entry.muscle
    if "library" not in value:
        return None
    table = {key: item for key, item in value.items() if key not in ("library", *SIZES)}
    entry = _load_entry(value["library"], location.inside("library"))
    sizes = {key: read_finite_number(value[key], "m", location.at(key)) for key in SIZES if key in value}
    with located_errors(location):
        entry = scale_entry(entry, **sizes)
    muscle: Muscle = reader.build(table, location, _entry_parts(entry, table, location), kind=Muscle)
    return muscle


def _named_orifice(table: Any, location: Location, reader: TableReader) -> Orifice | None:
    """An orifice of a valve of the library or of a valve file."""
    if not isinstance(table, Mapping) or "library" not in table:
        return None
    check_keys(table, ("library", "path"), location)
    path = read_text({"path": PATHS[0], **table}, "path", location, needed=True)
    valve = _load_valve(table, location)
    with located_errors(location):
        return valve.orifice(path)


def _named_driver(table: Any, location: Location, reader: TableReader) -> SolenoidDriver | None:
    """A driver with the switching times of a valve of the library or of a valve file."""
    if not isinstance(table, Mapping) or "library" not in table:
        return None
    check_keys(table, ("library",), location)
    valve = _load_valve(table, location)
    if valve.switching_times is None:
        raise ParameterError(
            f'{location}: {valve.name}: no switching times are published; write model = "SolenoidDriver" and its '
            "opening_delay."
        )
    return SolenoidDriver(valve.switching_times.opening_delay, valve.switching_times.closing_delay)


PLANT_READER = TableReader(
    named={Plant: _named_plant, Muscle: _named_muscle, Orifice: _named_orifice, Driver: _named_driver}
)
"""Reader of plants and their parts, which may be named."""


def _load_valve(table: Mapping[str, Any], location: Location) -> ValveEntry:
    name = read_text(table, "library", location, needed=True)
    with located_errors(location):
        return load_valve(location.folder / name if name.endswith(".toml") else name)


def _load_entry(value: Any, location: Location) -> Entry:
    if not isinstance(value, str):
        raise ParameterError(f"{location} is {abridged(value)}; name a library entry or a muscle file.")
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


def load(name_or_path: str | Path) -> AnyEntry:
    """A library entry (muscle, law, valve, plant or product) by its name or a unique beginning of it, in any case, or a
    file by its path.

    In a plant, write `.muscle` of an Entry, and `.valve` or `.exhaust` of a ValveEntry; a PlantEntry contains a
    `.plant`. Raises UnknownNameError, FileError, ParameterError or UnitError with the location. A warning of the entry
    is issued as an AirmuscleWarning.
    """
    tables, location = entry_tables(name_or_path)
    kind = kind_of(tables)
    entry: AnyEntry = build_plant_entry(tables, location) if kind is PlantEntry else build_entry(tables, location, kind)
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_data(name: str) -> Recording:
    """A data set of the library by its name or a unique beginning of it.

    The last note of the Recording is the header of the file, with source and licence; `cite` gives its references.
    """
    path = DATA / f"{complete_name(str(name), list_data(), 'data set')}.csv"
    recording: Recording = read_csv(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    header = " ".join(line.lstrip("# ") for line in lines if line.startswith("#") and " = " not in line)
    file = path.parent / "references.toml"
    sources = [source["reference"] for source in read_toml(file)["source"] if path.stem in source["data_sets"]]
    if not sources:
        raise FileError(f"{file}: there is no source of the data set '{path.stem}'.")
    references = tuple(Reference(**reference) for reference in sources[0])
    return dataclasses.replace(recording, notes=(*recording.notes, header), references=references)
