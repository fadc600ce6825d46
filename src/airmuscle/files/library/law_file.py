"""Loading of muscles and laws, from the library or from files of the same form."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.errors import ParameterError, UnknownNameError
from .entry import Entry, issue_warning
from .entry_file import build_entry
from .files import (
    LAWS,
    complete_name,
    entries_of_product,
    is_path,
    list_laws,
    list_plants,
    list_products,
    list_valves,
    read_toml,
)


def load_law(name_or_path: str | Path) -> Entry:
    """A muscle or a law by its name or a unique beginning of it, or its file by its path; as `load`, without valves."""
    if is_path(name_or_path):
        path = file = Path(name_or_path)
    else:
        path = LAWS / f"{_complete_law_name(str(name_or_path))}.toml"
        file = Path(path.name)
    tables = read_toml(path)
    if describes_plant(tables):
        raise ParameterError(f"{file}: the file describes a plant; a muscle or a law is required.")
    if describes_valve(tables):
        raise ParameterError(f"{file}: the file describes a valve; a muscle or a law is required.")
    if describes_product(tables):
        raise ParameterError(f"{file}: the file describes a product without a law; a muscle or a law is required.")
    entry = build_entry(tables, path.stem, file, path.parent)
    issue_warning(entry.name, entry.warning, stacklevel=2)
    return entry


def describes_valve(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a file describe a valve."""
    return "valve" in tables and "characteristic" not in tables


def describes_plant(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a file describe a plant."""
    return "plant" in tables and "characteristic" not in tables


def describes_product(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a file describe a product: ratings without a law."""
    return "ratings" in tables and "characteristic" not in tables


def _complete_law_name(name: str) -> str:
    if name in list_products():
        laws = entries_of_product(name)
        entries = f"its laws are {', '.join(laws)}" if laws else "no law of it is published; fit one to measurements"
        raise UnknownNameError(f"'{name}' is a product, of which the library states the permitted values; {entries}.")
    for kind, names in (("valve", list_valves()), ("plant", list_plants())):
        if name in names:
            raise UnknownNameError(f"'{name}' is a {kind}; a muscle or a law is required: {', '.join(list_laws())}.")
    return complete_name(name, list_laws(), "muscle or law")
