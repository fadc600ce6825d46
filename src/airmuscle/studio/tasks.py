"""Tasks of the studio: sheets of laws and plants from the library or from a text of a user."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..core.errors import ParameterError
from ..library.entry_file import build_entry
from ..library.law_file import describes_plant, describes_product, describes_valve, load_law
from .law_sheet import law_sheet
from .uploads import read_text_tables

UPLOADED = Path("muscle.toml")
"""The name of a text of a user in messages."""


def sheet_of_law(name: str) -> dict[str, Any]:
    """The sheet of a muscle or a law, by its name in the library or by its path."""
    return law_sheet(load_law(name))


def sheet_of_law_text(text: str) -> dict[str, Any]:
    """The sheet of a muscle file of a user. Raises ParameterError for another kind of file."""
    tables = read_text_tables(text)
    for kind, described in (("plant", describes_plant), ("valve", describes_valve), ("product", describes_product)):
        if described(tables):
            raise ParameterError(f"the text describes a {kind}; a muscle or a law is required.")
    return {**law_sheet(build_entry(tables, "own muscle", UPLOADED, Path())), "own_text": text}
