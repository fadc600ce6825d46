"""Any entry of the library by its name, whatever it describes: a muscle, a law or a valve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .catalogue import complete_name, list_laws, load, read_toml
from .entry import Entry
from .valve_catalogue import ValveEntry, load_valve, list_valves


def find(name_or_path: str | Path) -> Entry | ValveEntry:
    """A muscle, law or valve by its name, a unique beginning of it, or the path of its file.

    Raises UnknownName, FileError, ParameterError or UnitError, saying where.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or text.endswith(".toml") or "/" in text or "\\" in text:
        return load_valve(Path(name_or_path)) if _is_valve(read_toml(Path(name_or_path))) else load(name_or_path)
    name = complete_name(text, (*list_laws(), *list_valves()), "library entry")
    return load_valve(name) if name in list_valves() else load(name)


def _is_valve(tables: dict[str, Any]) -> bool:
    return "valve" in tables and "characteristic" not in tables
