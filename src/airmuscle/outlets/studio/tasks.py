"""Tasks of the studio: sheets of laws and plants from the library or from a text of a user, within limits.

Files in the library folder may refer to other files. A text over the network must not, because it would read files of
the machine of the server.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...bench.readers.file_kind import parse_toml
from ...core import ParameterError, is_known_unit
from ...files.library import Location, is_path, list_plants, plant_tables, read_toml
from ...files.library.entry_file import build_entry, check_describes_law, load_law
from .law_sheet import law_sheet
from .plant_sheet import sheet_of_plant, sheet_of_tables

MAX_TEXT = 64 * 1024
"""Largest size of a muscle or scenario file [bytes] (chosen)."""
FILE_KEYS = ("file", "mapping")
"""Keys whose value is a path."""
TEXT_KEYS = ("title", "provenance", "note", "warning", "source", "sources", "reference")
"""Keys of texts that are shown and not read as names."""
UPLOADED = Location("muscle.toml", "", Path())
"""The location of a text of a user in messages."""


def sheet_of_library_plant(name: str) -> dict[str, Any]:
    """The sheet of a plant of the library, by its complete name."""
    return sheet_of_plant(*plant_tables(name), name)


def warm_up() -> None:
    """Import what the sheets need, so that the first one is as fast as the next ones."""
    sheet_of_law("tondu-lopez")
    sheet_of_library_plant("lift-dmsp-20")


def sheet_of_scenario_text(text: str) -> dict[str, Any]:
    """The sheet of a scenario of a user."""
    tables = read_text_tables(text)
    if "plant" not in tables:
        raise ParameterError("the text contains no [plant]; a scenario for airmuscle simulate is required.")
    return sheet_of_tables(tables, Location("scenario.toml", "", Path()), "own scenario", {}, text)


def sheet_of_any(name: str) -> dict[str, Any]:
    """The sheet of a muscle, a law or a plant by its name, or of a muscle file or a scenario by its path."""
    if name in list_plants():
        return sheet_of_library_plant(name)
    path = Path(name)
    tables = read_toml(path) if is_path(name) else {}
    if "plant" in tables:
        return sheet_of_tables(tables, Location(str(path), "", path.parent), path.stem, {}, path.read_text("utf-8-sig"))
    sheet = law_sheet(load_law(name))
    return {**sheet, "own_text": sheet["toml"]["unchanged"]} if is_path(name) else sheet


def sheet_of_law(name: str) -> dict[str, Any]:
    """The sheet of a muscle or a law, by its name in the library or by its path."""
    return law_sheet(load_law(name))


def sheet_of_law_text(text: str) -> dict[str, Any]:
    """The sheet of a muscle file of a user. Raises ParameterError for another kind of file."""
    tables = read_text_tables(text)
    check_describes_law(tables, "the text")
    return {**law_sheet(dataclasses.replace(build_entry(tables, UPLOADED), name="own muscle")), "own_text": text}


def read_text_tables(text: str) -> dict[str, Any]:
    """The tables of a TOML text that refers to no file. Raises FileError or ParameterError."""
    tables = parse_toml(text.removeprefix("\ufeff"), "the text")
    check_self_contained(tables)
    return tables


def check_self_contained(value: Any, path: str = "") -> None:
    """Raise ParameterError if tables refer to a file; names of the library are allowed."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            inner = f"{path}.{key}" if path else key
            if key in FILE_KEYS:
                raise ParameterError(_refusal(inner))
            if key not in TEXT_KEYS:
                check_self_contained(item, inner)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            check_self_contained(item, f"{path}[{i}]")
    elif isinstance(value, str) and is_path(value) and not _is_quantity(value):
        raise ParameterError(_refusal(path))


def _is_quantity(text: str) -> bool:
    number, _, unit = text.strip().partition(" ")
    try:
        float(number)
    except ValueError:
        return False
    return is_known_unit(unit.strip())


def _refusal(path: str) -> str:
    return (
        f"{path[:200]}: a text in the studio must not refer to files; write the numbers themselves, or a name of the "
        "library. The command line reads files that refer to others."
    )
