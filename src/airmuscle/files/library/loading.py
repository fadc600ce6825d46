"""Entries by name or from files (muscles, laws, valves, products, plants), data sets, and the
plants of scenarios.

A plant of the library is a file of the same form as a scenario, with its provenance, and in
[sources] the source of each number of the tables, by its path or the beginning of its path. Parts
of a plant may be named: a muscle and a plant of the library or of a file, and an orifice or a
driver with the values of a valve, `{ library = "matrix-821" }`; of a muscle and of a plant the
other keys replace parts.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import NoneType
from typing import Any

from ... import bench
from ...core import FileError, ParameterError, Reference, UnknownNameError, abridged
from ...engine.loop.pwm_and_solenoid import Driver, SolenoidDriver
from ...physics import ForceLaw, Muscle, Orifice, Plant
from ...physics.muscle.geometry.base import Geometry
from ...recording import Recording
from . import (
    Location,
    check_keys,
    entries_of_product,
    is_path,
    list_data,
    list_laws,
    located_errors,
)
from .build import TableReader, build
from .entry import (
    MISSING_GEOMETRY,
    PATHS,
    AnyEntry,
    Entry,
    PlantEntry,
    ProductEntry,
    ValveEntry,
    issue_warning,
)
from .files import (
    DATA,
    FOLDERS,
    complete_name,
    list_names,
    read_finite_number,
    read_table,
    read_text,
    read_toml,
)
from .scaling import scale_entry

NOUNS: Mapping[type[Any], str] = {
    ValveEntry: "valve",
    PlantEntry: "plant",
    ProductEntry: "product",
    Entry: "muscle or law",
}
"""Kinds of entries in words, which are those of their folders."""
SCENARIO_TABLES: tuple[str, ...] = ("plant", "input", "run", "output")
"""Tables of a plant of the library that a scenario has, too."""
SIZES = ("resting_length", "diameter")
"""Sizes to which a table that names a library entry may scale its muscle."""


def load(name_or_path: str | Path) -> AnyEntry:
    """A library entry (muscle, law, valve, plant or product) by its name or a unique beginning of
    it, in any case, or a file by its path.

    In a plant, write `.muscle` of an Entry, and `.valve` or `.exhaust` of a ValveEntry; a
    PlantEntry contains a `.plant`. Raises UnknownNameError, FileError, ParameterError or UnitError
    with the location. A warning of the entry is issued as an AirmuscleWarning.
    """
    tables, location = entry_tables(name_or_path)
    entry: AnyEntry = build_entry(tables, location, kind_of(tables))
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_law(name_or_path: str | Path) -> Entry:
    """A muscle or a law by its name or a unique beginning of it, or its file by its path; as
    `load`, without valves.
    """
    tables, location = entry_tables(name_or_path, Entry)
    check_describes_law(tables, f"{location}: the file")
    entry: Entry = build_entry(tables, location)
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_valve(name_or_path: str | Path) -> ValveEntry:
    """A valve by its name or a unique beginning of it, or a valve file by its path; raises and
    warns as `load`.
    """
    entry: ValveEntry = build_entry(*entry_tables(name_or_path, ValveEntry), ValveEntry)
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry


def load_product(name: str) -> ProductEntry:
    """A commercial muscle by its name or a unique beginning of it. Raises UnknownNameError."""
    entry: ProductEntry = build_entry(*_tables_of_name(str(name), ProductEntry), ProductEntry)
    return entry


def entry_tables(
    name_or_path: str | Path, kind: type[Any] | None = None
) -> tuple[dict[str, Any], Location]:
    """The tables of an entry of this kind, or of any, by name or path, and their location."""
    if is_path(name_or_path):
        path = Path(name_or_path)
        return read_toml(path), Location.of_file(path)
    return _tables_of_name(str(name_or_path), kind)


def _tables_of_name(name: str, kind: type[Any] | None) -> tuple[dict[str, Any], Location]:
    """The tables of the entry of this kind, or of any, with a name or a unique beginning of it, and
    their location.
    """
    if kind is Entry and name not in list_names(FOLDERS[NOUNS[Entry]]):
        noun = next(
            (noun for noun, folder in FOLDERS.items() if name in list_names(folder)), NOUNS[Entry]
        )
        if noun == NOUNS[ProductEntry]:
            laws = ", ".join(entries_of_product(name))
            entries = (
                f"its laws are {laws}"
                if laws
                else "no law of it is published; fit one to measurements"
            )
            what = f"'{name}' is a product, of which the library states the permitted values"
            raise UnknownNameError(f"{what}; {entries}.")
        if noun != NOUNS[Entry]:
            raise UnknownNameError(
                f"'{name}' is a {noun}; a muscle or a law is required: {', '.join(list_laws())}."
            )
    noun, folders = (
        ("library entry", list(FOLDERS.values()))
        if kind is None
        else (NOUNS[kind], [FOLDERS[NOUNS[kind]]])
    )
    known = {name: folder for folder in folders for name in list_names(folder)}
    name = complete_name(name, sorted(known), noun)
    return read_toml(known[name] / f"{name}.toml"), Location(f"{name}.toml", "", known[name])


def plant_tables(name: str) -> tuple[dict[str, Any], Location]:
    """The tables of a plant of the library, by its name or a unique beginning of it, and their
    location.
    """
    tables, location = _tables_of_name(name, PlantEntry)
    issue_warning(Path(location.file).stem, tables.get("warning", ""), stacklevel=3)
    return tables, location


def kind_of(tables: Mapping[str, Any]) -> type[Any]:
    """The kind of the entry that tables describe."""
    kinds = {
        "characteristic": Entry,
        "valve": ValveEntry,
        "plant": PlantEntry,
        "ratings": ProductEntry,
    }
    return next((kind for table, kind in kinds.items() if table in tables), Entry)


def check_describes_law(tables: Mapping[str, Any], what: str) -> None:
    """Raise ParameterError unless tables describe a muscle or a law; `what` begins the message."""
    if (kind := kind_of(tables)) is not Entry:
        noun = "product without a law" if kind is ProductEntry else NOUNS[kind]
        raise ParameterError(f"{what} describes a {noun}; a muscle or a law is required.")


def build_entry(tables: Mapping[str, Any], location: Location, kind: type[Any] = Entry) -> Any:
    """The muscle, law, valve, product or plant of the tables of a file. The ratings of an Entry are
    those of its `product` unless it states some."""
    stated: dict[str, Any] = {"name": Path(location.file).stem}
    if kind is PlantEntry:
        keys = (*SCENARIO_TABLES, "sources")
        place = location.inside("sources")
        check_keys(tables, ("title", "provenance", "note", "warning", *keys, "reference"), location)
        sources = read_table(tables.get("sources", {}), None, place, " of paths and sources")
        stated["plant"] = build_plant(tables["plant"], location.inside("plant"))
        stated["sources"] = tuple(
            (path, read_text(sources, path, place, needed=True)) for path in sources
        )
        tables = {key: value for key, value in tables.items() if key not in keys}
    cited: tuple[Reference, ...] = ()
    if kind is Entry and "product" in tables:
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
    entry = build(tables, location, stated, kind=kind)
    if kind is not Entry:
        return entry
    inside = getattr(entry.characteristic, "geometry", None)
    geometry = inside if entry.geometry is None and isinstance(inside, Geometry) else entry.geometry
    return dataclasses.replace(entry, geometry=geometry, references=(*entry.references, *cited))


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


def load_data(name: str) -> Recording:
    """A data set of the library by its name or a unique beginning of it.

    The last note of the Recording is the header of the file, with source and licence; `cite` gives
    its references.
    """
    path = DATA / f"{complete_name(str(name), list_data(), 'data set')}.csv"
    recording: Recording = bench.read_csv(path)
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
    return dataclasses.replace(recording, notes=(*recording.notes, header), references=references)
