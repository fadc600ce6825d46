"""The entry of a name or a file; its stub states the type of each name of the library."""

from pathlib import Path

from .. import library
from .entry import issue_warning
from .loading import build_entry, entry_tables, kind_of


def load(name_or_path: str | Path) -> "library.AnyEntry":
    """A library entry (muscle, law, valve, plant or product) by its name or a unique beginning of
    it, in any case, or a file by its path.

    In a plant, write `.muscle` of an Entry, and `.valve` or `.exhaust` of a ValveEntry; a
    PlantEntry contains a `.plant`. Raises UnknownNameError, FileError, ParameterError or UnitError
    with the location. A warning of the entry is issued as an AirmuscleWarning.
    """
    tables, location = entry_tables(name_or_path)
    entry: library.AnyEntry = build_entry(tables, location, kind_of(tables))
    issue_warning(entry.name, entry.warning, stacklevel=3)
    return entry
