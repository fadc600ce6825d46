"""Loading of library entries and data sets by name, and of files of the same form by path.

`load("dmsp-20-300")`, `load("matrix-821")`, `load("joint-dmsp-20-matrix")` and `load("my/muscle.toml")` return an
Entry, a ValveEntry or a PlantEntry; a unique beginning of a name is sufficient.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ...bench.readers import read_csv
from ...core.errors import FileError
from ...core.reference import Reference
from ...recording import Recording
from .build import build_valve_entry
from .entry import Entry, issue_warning
from .entry_file import build_entry
from .files import (
    DATA,
    LAWS,
    PLANTS,
    PRODUCTS,
    VALVES,
    complete_name,
    is_path,
    list_data,
    list_library,
    list_plants,
    list_products,
    list_valves,
    read_toml,
)
from .law_file import describes_plant, describes_product, describes_valve
from .location import Location
from .plant_file import PlantEntry, build_plant_entry
from .product_entry import ProductEntry, build_product_entry
from .references import read_references
from .valve_entry import ValveEntry


def load(name_or_path: str | Path) -> Entry | ValveEntry | PlantEntry | ProductEntry:
    """A library entry (muscle, law, valve, plant or product) by its name or a unique beginning of it, in any case, or a
    file by its path.

    In a plant, write `.muscle` of an Entry, and `.valve` or `.exhaust` of a ValveEntry; a PlantEntry contains a
    `.plant`. Raises UnknownNameError, FileError, ParameterError or UnitError with the location. A warning of the entry
    is issued as an AirmuscleWarning.
    """
    if is_path(name_or_path):
        path = file = Path(name_or_path)
    else:
        name = complete_name(str(name_or_path), list_library(), "library entry")
        folder = _folder_of(name)
        path = folder / f"{name}.toml"
        file = Path(path.name)
    tables = read_toml(path)
    entry: Entry | ValveEntry | PlantEntry | ProductEntry
    if describes_valve(tables):
        entry = build_valve_entry(tables, path.stem, file)
    elif describes_plant(tables):
        entry = build_plant_entry(tables, path.stem, file, path.parent)
    elif describes_product(tables):
        entry = build_product_entry(tables, path.stem, file)
    else:
        entry = build_entry(tables, path.stem, file, path.parent)
    issue_warning(entry.name, entry.warning, stacklevel=2)
    return entry


def _folder_of(name: str) -> Path:
    """The folder of the file of an entry."""
    folders = ((VALVES, list_valves()), (PLANTS, list_plants()), (PRODUCTS, list_products()))
    return next((folder for folder, names in folders if name in names), LAWS)


def load_data(name: str) -> Recording:
    """A data set of the library by its name or a unique beginning of it.

    The last note of the Recording is the header of the file, with source and licence; `cite` gives its references.
    """
    path = DATA / f"{complete_name(str(name), list_data(), 'data set')}.csv"
    recording: Recording = read_csv(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    header = " ".join(line.lstrip("# ") for line in lines if line.startswith("#") and " = " not in line)
    return dataclasses.replace(recording, notes=(*recording.notes, header), references=_data_references(path))


def _data_references(path: Path) -> tuple[Reference, ...]:
    """References of a data set, from the file on the sources of its folder."""
    file = path.parent / "references.toml"
    for i, source in enumerate(read_toml(file)["source"], 1):
        if path.stem in source["data_sets"]:
            return read_references(source, Location(file.name, f"source.{i}", file.parent))
    raise FileError(f"{file}: there is no source of the data set '{path.stem}'.")
