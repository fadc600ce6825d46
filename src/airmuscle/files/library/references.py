"""Reading of [[reference]] tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...core.errors import ParameterError
from ...core.reference import Reference
from .location import Location, check_keys, read_table_array, read_text

_KEYS = ("key", "authors", "title", "where", "year", "doi", "note")
_OPTIONAL_KEYS = ("doi", "note")


def read_references(tables: Mapping[str, Any], location: Location) -> tuple[Reference, ...]:
    """References of a file. Raises ParameterError."""
    return tuple(_read_reference(table, inner) for table, inner in read_table_array(tables, "reference", location))


def _read_reference(table: Mapping[str, Any], location: Location) -> Reference:
    check_keys(table, _KEYS, location)
    for key in (key for key in _KEYS if key != "year"):
        read_text(table, key, location, needed=key not in _OPTIONAL_KEYS)
    if not isinstance(table.get("year", 0), int) or isinstance(table.get("year"), bool):
        raise ParameterError(f"{location}: year is {table['year']!r}; it must be an integer.")
    return Reference(**table)
