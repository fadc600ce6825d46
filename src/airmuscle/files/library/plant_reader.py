"""Plants of the library and of scenarios.

A plant of the library is a file of the same form as a scenario, with its provenance, and in
[sources] the source of each number of the tables, by its path or the beginning of its path. Parts
of a plant may be named: a muscle and a plant of the library or of a file, and an orifice or a
driver with the values of a valve, `{ library = "matrix-821" }`; of a muscle and of a plant the
other keys replace parts.
"""

import dataclasses
from collections.abc import Mapping
from types import NoneType
from typing import Any

from ...core import ParameterError, abridged
from ...engine.loop.pwm_and_solenoid import Driver, SolenoidDriver
from ...physics import ForceLaw, Muscle, Orifice, Plant
from .build import TableReader
from .entry import MISSING_GEOMETRY, Entry
from .files import Location, check_keys, located_errors, read_finite_number, read_text
from .loading import load_law, load_valve, plant_tables
from .scaling import scale_entry
from .valve_entry import PATHS, ValveEntry

SIZES = ("resting_length", "diameter")
"""Sizes to which a table that names a library entry may scale its muscle."""


def build_plant(table: Any, location: Location) -> Plant:
    """The plant of a table [plant]."""
    plant: Plant = PLANT_READER.build(table, location, kind=Plant)
    return plant


def _named_plant(table: Any, location: Location, reader: TableReader) -> Plant | None:
    """A plant of the library, with the parts that a table replaces."""
    if not isinstance(table, Mapping):
        return None
    if not {"library", "muscle"} & set(table):
        raise ParameterError(
            f"{location}: 'muscle' is missing; name a library entry or a muscle file, or write"
            " [plant.muscle]."
        )
    if "library" not in table:
        return None
    if not isinstance(table["library"], str):
        raise ParameterError(
            f"{location.inside('library')} is {abridged(table['library'])}; name a library plant."
        )
    with located_errors(location.inside("library")):
        tables, _ = plant_tables(table["library"])
    replaced = {key: value for key, value in table.items() if key != "library"}
    plant: Plant = reader.build({**tables["plant"], **replaced}, location, kind=Plant)
    return plant


def _named_muscle(value: Any, location: Location, reader: TableReader) -> Muscle | None:
    """A library entry or a muscle file, with the parts that a table replaces."""
    table = value if isinstance(value, Mapping) else {"library": value}
    if "library" not in table:
        return None
    name = table["library"]
    place = location.inside("library") if table is value else location
    if not isinstance(name, str):
        raise ParameterError(f"{place} is {abridged(name)}; name a library entry or a muscle file.")
    with located_errors(place):
        entry = load_law(location.folder / name if name.endswith(".toml") else name)
    if table is not value:
        with located_errors(location):
            return entry.muscle
    replaced = {key: item for key, item in table.items() if key not in ("library", *SIZES)}
    sizes = {
        key: read_finite_number(table[key], "m", location.at(key)) for key in SIZES if key in table
    }
    with located_errors(location):
        entry = scale_entry(entry, **sizes)
    muscle: Muscle = reader.build(
        replaced, location, _entry_parts(entry, replaced, location), kind=Muscle
    )
    return muscle


def _named_orifice(table: Any, location: Location, reader: TableReader) -> Orifice | None:
    """An orifice of a valve of the library or of a valve file."""
    valve = _named_valve(table, location, ("library", "path"))
    if valve is None:
        return None
    path = read_text({"path": PATHS[0], **table}, "path", location, needed=True)
    with located_errors(location):
        return valve.orifice(path)


def _named_driver(table: Any, location: Location, reader: TableReader) -> SolenoidDriver | None:
    """A driver with the switching times of a valve of the library or of a valve file."""
    valve = _named_valve(table, location, ("library",))
    if valve is None:
        return None
    if valve.switching_times is None:
        raise ParameterError(
            f"{location}: {valve.name}: no switching times are published; write model ="
            ' "SolenoidDriver" and its opening_delay.'
        )
    return SolenoidDriver(valve.switching_times.opening_delay, valve.switching_times.closing_delay)


def _named_valve(table: Any, location: Location, keys: tuple[str, ...]) -> ValveEntry | None:
    """The valve that a table names, whose other keys are these; None if it names none."""
    if not isinstance(table, Mapping) or "library" not in table:
        return None
    check_keys(table, keys, location)
    name = read_text(table, "library", location, needed=True)
    with located_errors(location):
        return load_valve(location.folder / name if name.endswith(".toml") else name)


PLANT_READER = TableReader(
    named={
        Plant: _named_plant,
        Muscle: _named_muscle,
        Orifice: _named_orifice,
        Driver: _named_driver,
    }
)
"""Reader of plants and their parts, which may be named."""


def _entry_parts(entry: Entry, replaced: Mapping[str, Any], location: Location) -> dict[str, Any]:
    """Parts of an entry that a table does not replace; the table may add missing parts, such as a
    geometry.
    """
    names = [f.name for f in dataclasses.fields(Muscle) if f.name not in ("contractile", "name")]
    parts = {
        "contractile": entry.characteristic,
        **{name: getattr(entry, name, None) for name in names},
    }
    if "contractile" in replaced:
        del parts["validity_range"]  # it belongs to the replaced law
    retained = {
        name: part for name, part in parts.items() if part is not None and name not in replaced
    }
    if not isinstance(retained.get("contractile"), ForceLaw | NoneType):
        raise ParameterError(
            f"{location}: {entry.name} is {type(entry.characteristic).__name__}, which is not"
            " solved for the force; a plant needs a ForceLaw. In Python, as_force_law(law,"
            " validity range) makes one."
        )
    if "geometry" not in {*retained, *replaced}:
        raise ParameterError(f"{location}: {entry.name} lacks {MISSING_GEOMETRY}.")
    return retained
