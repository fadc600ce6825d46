"""Loading of library entries and data sets by name, and of files of the same form by path.

`load("dmsp-20-300")`, `load("matrix-821")`, `load("joint-dmsp-20-matrix")` and `load("my/muscle.toml")` return an
Entry, a ValveEntry or a PlantEntry; a unique beginning of a name is sufficient.
"""

import dataclasses
from pathlib import Path

from ...bench.readers import read_csv
from ...core import FileError, Reference
from ...recording import Recording
from .entry import AnyEntry, PlantEntry, issue_warning
from .entry_file import build_entry, kind_of
from .files import DATA, FOLDERS, complete_name, is_path, list_data, list_library, list_names, read_toml
from .location import Location
from .plant_file import build_plant_entry


def load(name_or_path: str | Path) -> AnyEntry:
    """A library entry (muscle, law, valve, plant or product) by its name or a unique beginning of it, in any case, or a
    file by its path.

    In a plant, write `.muscle` of an Entry, and `.valve` or `.exhaust` of a ValveEntry; a PlantEntry contains a
    `.plant`. Raises UnknownNameError, FileError, ParameterError or UnitError with the location. A warning of the entry
    is issued as an AirmuscleWarning.
    """
    if is_path(name_or_path):
        path = Path(name_or_path)
        location = Location.of_file(path)
    else:
        name = complete_name(str(name_or_path), list_library(), "library entry")
        folder = next(folder for folder in FOLDERS.values() if name in list_names(folder))
        path = folder / f"{name}.toml"
        location = Location(path.name, "", folder)
    tables = read_toml(path)
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
    return dataclasses.replace(recording, notes=(*recording.notes, header), references=_data_references(path))


def _data_references(path: Path) -> tuple[Reference, ...]:
    """References of a data set, from the file on the sources of its folder."""
    file = path.parent / "references.toml"
    for source in read_toml(file)["source"]:
        if path.stem in source["data_sets"]:
            return tuple(Reference(**reference) for reference in source["reference"])
    raise FileError(f"{file}: there is no source of the data set '{path.stem}'.")
