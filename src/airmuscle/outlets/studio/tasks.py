"""Tasks of the studio: sheets of laws and plants from the library or from a text of a user."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from ...core.errors import ParameterError
from ...files.library.entry_file import build_entry, check_describes_law, load_law
from ...files.library.files import is_path, list_plants, read_toml
from ...files.library.location import Location
from ...files.library.plant_file import plant_tables
from .law_sheet import law_sheet
from .plant_sheet import sheet_of_plant, sheet_of_tables
from .uploads import read_text_tables

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
