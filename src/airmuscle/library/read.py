"""From the tables of a library file to an Entry."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import units
from ..characteristic.base import Characteristic
from ..errors import ParameterError, suggestion
from ..geometry.base import Geometry
from ..muscle import Damper, Spring
from ..reference import Reference
from .build import Place, build
from .entry import Check, Entry

QUANTITIES = {"pressure": "Pa", "contraction": "1", "force": "N", "volume": "m3"}
"""What a check may give and ask for, with the unit its plain numbers are in."""

_GIVEN = {
    "pressure": ("contraction", "force"),
    "contraction": ("pressure", "force"),
    "force": ("pressure", "contraction"),
    "volume": ("contraction",),
}
_TEXTS = ("title", "trust", "note", "warning")
_PARTS = {"characteristic": Characteristic, "geometry": Geometry, "spring": Spring, "damper": Damper}
_KEYS = (*_TEXTS, *_PARTS, "box", "check", "reference")
_CHECK_TEXTS = ("quantity", "source")
_CHECK_KEYS = (*_CHECK_TEXTS, "equals", "tolerance", *QUANTITIES)
_REFERENCE_KEYS = ("key", "authors", "title", "where", "year", "doi", "note")


def entry_from(tables: Mapping[str, Any], name: str, file: Path, folder: Path) -> Entry:
    """The entry that a parsed file describes; messages name `file`, data files are relative to `folder`."""
    place = Place(str(file), "", folder)
    _refuse_unknown(tables, _KEYS, place)
    texts: dict[str, Any] = {key: _text(tables, key, place, needed=key in ("title", "trust")) for key in _TEXTS}
    if "characteristic" not in tables:
        raise ParameterError(f"{place}: the table [characteristic] is missing; it says which law and its parameters.")
    parts = {key: _part(tables[key], kind, place.inside(key)) for key, kind in _PARTS.items() if key in tables}
    if "geometry" not in parts:
        own = getattr(parts["characteristic"], "geometry", None)
        parts["geometry"] = own if isinstance(own, Geometry) else None
    return Entry(
        name=name,
        **texts,
        **parts,
        box=build({"model": "Box", **tables["box"]}, place.inside("box")) if "box" in tables else None,
        checks=tuple(_check(t, p) for t, p in _rows(tables, "check", place)),
        references=tuple(_reference(t, p) for t, p in _rows(tables, "reference", place)),
    )


def _part(table: Any, kind: type[Any], place: Place) -> Any:
    found = build(table, place)
    if not isinstance(found, kind):
        raise ParameterError(f"{place}: {type(found).__name__} is no {kind.__name__.lower()}.")
    return found


def _rows(tables: Mapping[str, Any], key: str, place: Place) -> list[tuple[Mapping[str, Any], Place]]:
    rows = tables.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise ParameterError(f"{place}: '{key}' must be written as [[{key}]], once for each.")
    return [(row, place.inside(f"{key} {i}")) for i, row in enumerate(rows, 1)]


def _refuse_unknown(table: Mapping[str, Any], known: tuple[str, ...], place: Place) -> None:
    for key in table:
        if key not in known:
            raise ParameterError(
                f"{place}: '{key}' is not known here; there are {', '.join(known)}.{suggestion(key, known)}"
            )


def _text(table: Mapping[str, Any], key: str, place: Place, *, needed: bool) -> str:
    value = table.get(key, "")
    if not isinstance(value, str):
        raise ParameterError(f"{place}: {key} is {value!r}; it must be text.")
    if needed and not value.strip():
        raise ParameterError(f"{place}: '{key}' is missing; it must be text.")
    return value


def _check(table: Mapping[str, Any], place: Place) -> Check:
    _refuse_unknown(table, _CHECK_KEYS, place)
    quantity, source = (_text(table, key, place, needed=True) for key in _CHECK_TEXTS)
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
    given = tuple((key, _number(table[key], key, key, place)) for key in QUANTITIES if key in table)
    wanted = _GIVEN[quantity]
    if tuple(key for key, _ in given) != wanted:
        raise ParameterError(f"{place}: to check the {quantity}, give {' and '.join(wanted)}, and nothing else.")
    equals, tolerance = (_number(table[key], key, quantity, place) for key in ("equals", "tolerance"))
    return Check(quantity, given, equals, tolerance, source)


def _number(value: Any, key: str, quantity: str, place: Place) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ParameterError(f"{place}, {key} is {value!r}; it must be a number in {QUANTITIES[quantity]}.")
    return units.quantity(value, QUANTITIES[quantity], where=f"{place}, {key}")


def _reference(table: Mapping[str, Any], place: Place) -> Reference:
    _refuse_unknown(table, _REFERENCE_KEYS, place)
    for key in ("key", "authors", "title", "where"):
        _text(table, key, place, needed=True)
    if not isinstance(table.get("year", 0), int):
        raise ParameterError(f"{place}: year is {table['year']!r}; it must be a whole number.")
    return Reference(**table)
