"""Entry files: from the TOML tables of a muscle or a law to an Entry."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.errors import ParameterError, suggestion
from ...physics.muscle import CreepElements, Damper, SeriesElement, Spring, Stop, Wall
from ...physics.muscle.characteristic.base import Characteristic
from ...physics.muscle.characteristic.validity_range import ValidityRange
from ...physics.muscle.friction.base import Friction
from ...physics.muscle.geometry.base import Geometry
from .build import TEXT_KEYS, build, read_entry_texts
from .entry import Check, Entry
from .location import Location, check_keys, check_type, read_finite_number, read_table_array, read_text
from .product_entry import build_limits, read_ratings
from .references import read_references
from .stated_band import read_stated_band
from .uncertainty import read_uncertainty

QUANTITIES = {"pressure": "Pa", "contraction": "1", "force": "N", "volume": "m3"}
"""Quantities of a check, each with the unit of numbers without a unit."""
PARTS = {
    "characteristic": Characteristic, "geometry": Geometry, "spring": Spring, "damper": Damper, "friction": Friction,
    "wall": Wall, "series": SeriesElement, "stop": Stop, "creep": CreepElements,
}  # fmt: skip
"""Tables of an entry file that describe a model, each with the class that is required."""
KEYS = (*TEXT_KEYS, *PARTS, "product", "ratings", "validity_range", "uncertainty", "error_band", "check", "reference")
"""Keys of an entry file."""
_CONDITIONS = {
    "pressure": ("contraction", "force"),
    "contraction": ("pressure", "force"),
    "force": ("pressure", "contraction"),
    "volume": ("contraction",),
}
_CHECK_TEXTS = ("quantity", "source")
_CHECK_KEYS = (*_CHECK_TEXTS, "equals", "tolerance", *QUANTITIES)


def build_entry(tables: Mapping[str, Any], name: str, file: Path, folder: Path) -> Entry:
    """The entry of the tables of a file; error messages name `file`, data files are relative to `folder`.

    Raises UnknownNameError, FileError, ParameterError or UnitError with the location.
    """
    location = Location(str(file), "", folder)
    check_keys(tables, KEYS, location)
    texts = read_entry_texts(tables, location)
    if "characteristic" not in tables:
        raise ParameterError(
            f"{location}: the table [characteristic] is missing; it names a force law and its parameters."
        )
    parts = {
        key: check_type(build(tables[key], location.inside(key), kind=kind), kind, location.inside(key))
        for key, kind in PARTS.items()
        if key in tables
    }
    if "geometry" not in parts:
        geometry = getattr(parts["characteristic"], "geometry", None)
        parts["geometry"] = geometry if isinstance(geometry, Geometry) else None
    ratings, product_references = read_ratings(tables, location)
    return Entry(
        name=name,
        **texts,
        **parts,
        ratings=ratings,
        validity_range=build_limits(ValidityRange, tables["validity_range"], location.inside("validity_range"))
        if "validity_range" in tables
        else None,
        checks=tuple(_read_check(*row) for row in read_table_array(tables, "check", location)),
        references=(*read_references(tables, location), *product_references),
        uncertainty=read_uncertainty(tables["uncertainty"], location.inside("uncertainty"))
        if "uncertainty" in tables
        else None,
        error_band=read_stated_band(tables["error_band"], location.inside("error_band"))
        if "error_band" in tables
        else None,
    )


def _read_check(table: Mapping[str, Any], location: Location) -> Check:
    check_keys(table, _CHECK_KEYS, location)
    quantity, source = (read_text(table, key, location, needed=True) for key in _CHECK_TEXTS)
    if quantity not in QUANTITIES:
        raise ParameterError(
            f"{location}: quantity '{quantity}' cannot be checked; there are {', '.join(QUANTITIES)}."
            f"{suggestion(quantity, QUANTITIES)}"
        )
    for key in ("equals", "tolerance"):
        if key not in table:
            raise ParameterError(
                f"{location}: '{key}' is missing; give a number in {QUANTITIES[quantity]}, or a text with a unit."
            )
    conditions = tuple((key, _read_value(table, key, key, location)) for key in QUANTITIES if key in table)
    required = _CONDITIONS[quantity]
    if tuple(key for key, _ in conditions) != required:
        raise ParameterError(
            f"{location}: a check of the {quantity} requires {' and '.join(required)}, and no other quantity."
        )
    equals, tolerance = (_read_value(table, key, quantity, location) for key in ("equals", "tolerance"))
    if tolerance < 0:
        raise ParameterError(f"{location}: tolerance is {table['tolerance']!r}; it must not be negative.")
    return Check(quantity, conditions, equals, tolerance, source)


def _read_value(table: Mapping[str, Any], key: str, quantity: str, location: Location) -> float:
    return read_finite_number(table[key], QUANTITIES[quantity], f"{location}, {key}")
