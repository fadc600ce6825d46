"""From the tables of a library file to an Entry."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..characteristic.base import Characteristic
from ..characteristic.validity_range import ValidityRange
from ..core.errors import ParameterError, suggestion
from ..core.reference import Reference
from ..friction.base import Friction
from ..geometry.base import Geometry
from ..muscle import CreepElements, Damper, SeriesElement, Spring, Stop, Wall
from .build import build
from .entry import Check, Entry
from .location import Location, check_keys, check_type, read_finite_number, read_text

QUANTITIES = {"pressure": "Pa", "contraction": "1", "force": "N", "volume": "m3"}
"""What a check may give and ask for, with the unit its plain numbers are in."""

_GIVEN = {
    "pressure": ("contraction", "force"),
    "contraction": ("pressure", "force"),
    "force": ("pressure", "contraction"),
    "volume": ("contraction",),
}
_TEXTS = ("title", "provenance", "note", "warning")
_PARTS = {
    "characteristic": Characteristic, "geometry": Geometry, "spring": Spring, "damper": Damper, "friction": Friction,
    "wall": Wall, "series": SeriesElement, "stop": Stop, "creep": CreepElements,
}  # fmt: skip
_KEYS = (*_TEXTS, *_PARTS, "validity_range", "check", "reference")
_CHECK_TEXTS = ("quantity", "source")
_CHECK_KEYS = (*_CHECK_TEXTS, "equals", "tolerance", *QUANTITIES)
_REFERENCE_KEYS = ("key", "authors", "title", "where", "year", "doi", "note")


def build_entry(tables: Mapping[str, Any], name: str, file: Path, folder: Path) -> Entry:
    """The entry that a parsed file describes; messages name `file`, data files are relative to `folder`."""
    place = Location(str(file), "", folder)
    check_keys(tables, _KEYS, place)
    texts: dict[str, Any] = {
        key: read_text(tables, key, place, needed=key in ("title", "provenance")) for key in _TEXTS
    }
    if "characteristic" not in tables:
        raise ParameterError(f"{place}: the table [characteristic] is missing; it says which law and its parameters.")
    parts = {
        key: check_type(build(tables[key], place.inside(key)), kind, place.inside(key))
        for key, kind in _PARTS.items()
        if key in tables
    }
    if "geometry" not in parts:
        own = getattr(parts["characteristic"], "geometry", None)
        parts["geometry"] = own if isinstance(own, Geometry) else None
    return Entry(
        name=name,
        **texts,
        **parts,
        validity_range=_validity_range(tables["validity_range"], place.inside("validity_range"))
        if "validity_range" in tables
        else None,
        checks=tuple(_check(t, p) for t, p in read_table_array(tables, "check", place)),
        references=read_references(tables, place),
    )


def _validity_range(table: Any, place: Location) -> Any:
    named = {"model": "ValidityRange", **table} if isinstance(table, Mapping) else table
    return check_type(build(named, place), ValidityRange, place)


def read_table_array(tables: Mapping[str, Any], key: str, place: Location) -> list[tuple[Mapping[str, Any], Location]]:
    """The tables written as [[key]], each with its place."""
    rows = tables.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise ParameterError(f"{place}: '{key}' must be written as [[{key}]], once for each.")
    return [(row, place.inside(f"{key} {i}")) for i, row in enumerate(rows, 1)]


def _check(table: Mapping[str, Any], place: Location) -> Check:
    check_keys(table, _CHECK_KEYS, place)
    quantity, source = (read_text(table, key, place, needed=True) for key in _CHECK_TEXTS)
    if quantity not in QUANTITIES:
        raise ParameterError(
            f"{place}: quantity '{quantity}' cannot be checked; there are {', '.join(QUANTITIES)}."
            f"{suggestion(quantity, QUANTITIES)}"
        )
    for key in ("equals", "tolerance"):
        if key not in table:
            raise ParameterError(
                f"{place}: '{key}' is missing; it is a number in {QUANTITIES[quantity]}, or text with a unit."
            )
    given = tuple((key, _value(table, key, key, place)) for key in QUANTITIES if key in table)
    wanted = _GIVEN[quantity]
    if tuple(key for key, _ in given) != wanted:
        raise ParameterError(f"{place}: to check the {quantity}, give {' and '.join(wanted)}, and nothing else.")
    equals, tolerance = (_value(table, key, quantity, place) for key in ("equals", "tolerance"))
    if tolerance < 0:
        raise ParameterError(f"{place}: tolerance is {table['tolerance']!r}; it must be zero or more.")
    return Check(quantity, given, equals, tolerance, source)


def _value(table: Mapping[str, Any], key: str, quantity: str, place: Location) -> float:
    return read_finite_number(table[key], QUANTITIES[quantity], f"{place}, {key}")


def read_references(tables: Mapping[str, Any], place: Location) -> tuple[Reference, ...]:
    """The sources that a file names."""
    return tuple(_reference(t, p) for t, p in read_table_array(tables, "reference", place))


def _reference(table: Mapping[str, Any], place: Location) -> Reference:
    check_keys(table, _REFERENCE_KEYS, place)
    for key in ("key", "authors", "title", "where", "doi", "note"):
        read_text(table, key, place, needed=key not in ("doi", "note"))
    if not isinstance(table.get("year", 0), int) or isinstance(table.get("year"), bool):
        raise ParameterError(f"{place}: year is {table['year']!r}; it must be a whole number.")
    return Reference(**table)
