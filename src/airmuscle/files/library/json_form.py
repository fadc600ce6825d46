"""Muscle file as JSON: the tables of its TOML file in SI units, with the unit of each parameter."""

import json
import tomllib
from typing import Any

from ...core import leaves
from .entry import Entry
from .entry_display import PARTS
from .write import to_toml


def muscle_json(entry: Entry) -> str:
    """The JSON text of an entry: "muscle", the tables of its file with numbers in SI units, and
    "units", the SI unit of each parameter by its path.
    """
    parts = {name: part for name in PARTS if (part := getattr(entry, name, None)) is not None}
    units: dict[str, Any] = {
        f"{name}.{leaf.path}": leaf.declared.unit
        for name, part in parts.items()
        for leaf in leaves(part)
    }
    tables = tomllib.loads(to_toml(entry))
    content = {"name": entry.name, "muscle": tables, "units": units}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
