"""Loading of library entries and data sets by name, and of files of the same form by path.

`load("dmsp-20-300")`, `load("matrix-821")` and `load("my/muscle.toml")` return an Entry or a ValveEntry; a unique
beginning of a name is sufficient.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.errors import ParameterError, UnknownNameError
from ..recording import Recording, read_csv
from .build import build_valve_entry
from .entry import Entry, issue_warning
from .entry_file import build_entry
from .files import (
    DATA,
    LAWS,
    PRODUCTS,
    VALVES,
    complete_name,
    is_path,
    list_data,
    list_laws,
    list_library,
    list_products,
    list_valves,
    read_toml,
)
from .product_entry import ProductEntry, build_product_entry
from .valve_entry import ValveEntry


def load(name_or_path: str | Path) -> Entry | ValveEntry | ProductEntry:
    """A library entry (muscle, law, valve or product) by its name or a unique beginning of it, or a file by its path.

    In a plant, write `.muscle` of an Entry, and `.valve` or `.exhaust` of a ValveEntry. Raises UnknownNameError,
    FileError, ParameterError or UnitError with the location. A warning of the entry is issued as an AirmuscleWarning.
    """
    if is_path(name_or_path):
        path = file = Path(name_or_path)
    else:
        name = complete_name(str(name_or_path), list_library(), "library entry")
        folder = VALVES if name in list_valves() else PRODUCTS if name in list_products() else LAWS
        path = folder / f"{name}.toml"
        file = Path(path.name)
    tables = read_toml(path)
    entry: Entry | ValveEntry | ProductEntry
    if _describes_valve(tables):
        entry = build_valve_entry(tables, path.stem, file)
    elif _describes_product(tables):
        entry = build_product_entry(tables, path.stem, file)
    else:
        entry = build_entry(tables, path.stem, file, path.parent)
    issue_warning(entry.name, entry.warning, stacklevel=2)
    return entry


def load_law(name_or_path: str | Path) -> Entry:
    """A muscle or a law by its name or a unique beginning of it, or its file by its path; as `load`, without valves."""
    if is_path(name_or_path):
        path = file = Path(name_or_path)
    else:
        path = LAWS / f"{_complete_law_name(str(name_or_path))}.toml"
        file = Path(path.name)
    tables = read_toml(path)
    if _describes_valve(tables):
        raise ParameterError(f"{file}: the file describes a valve; a muscle or a law is required.")
    if _describes_product(tables):
        raise ParameterError(f"{file}: the file describes a product without a law; a muscle or a law is required.")
    entry = build_entry(tables, path.stem, file, path.parent)
    issue_warning(entry.name, entry.warning, stacklevel=2)
    return entry


def load_data(name: str) -> Recording:
    """A data set of the library by its name or a unique beginning of it.

    The last note of the Recording is the header of the file, with source and licence.
    """
    path = DATA / f"{complete_name(str(name), list_data(), 'data set')}.csv"
    recording: Recording = read_csv(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    header = " ".join(line.lstrip("# ") for line in lines if line.startswith("#") and " = " not in line)
    return dataclasses.replace(recording, notes=(*recording.notes, header))


def _describes_valve(tables: Mapping[str, Any]) -> bool:
    return "valve" in tables and "characteristic" not in tables


def _describes_product(tables: Mapping[str, Any]) -> bool:
    return "ratings" in tables and "characteristic" not in tables


def entries_of_product(name: str) -> tuple[str, ...]:
    """Names of the muscles and laws of the library that were measured on a product, sorted."""
    return tuple(law for law in list_laws() if read_toml(LAWS / f"{law}.toml").get("product") == name)


def _complete_law_name(name: str) -> str:
    if name in list_products():
        laws = entries_of_product(name)
        entries = f"its laws are {', '.join(laws)}" if laws else "no law of it is published; fit one to measurements"
        raise UnknownNameError(f"'{name}' is a product, of which the library states the permitted values; {entries}.")
    if name in list_valves():
        raise UnknownNameError(f"'{name}' is a valve; a muscle or a law is required: {', '.join(list_laws())}.")
    return complete_name(name, list_laws(), "muscle or law")
