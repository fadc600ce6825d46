"""Stated band of a muscle file: half widths of the 95 % band of the predicted quantity, and its records."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ...core.errors import ParameterError
from ...recording.columns import QUANTITIES
from .location import Location, check_keys, read_finite_number, read_text

KEYS = (
    "quantity", "half_width", "source", "held_half_width", "specimens", "resting_lengths", "new_specimen_half_width",
    "new_specimen_source", "max_contraction_rate", "max_pressure_rate",
)  # fmt: skip
"""Keys of the table [error_band]."""
WIDTHS = ("half_width", "held_half_width", "new_specimen_half_width")
"""Those of them that are half widths, in the unit of the quantity."""
RATES = {"max_contraction_rate": "1/s", "max_pressure_rate": "Pa/s"}
"""Those of them that are rates of change, with their units."""
PREDICTED = ("force", "contraction", "pressure")
"""Quantities that a law may give."""


@dataclasses.dataclass(frozen=True)
class StatedBand:
    """The half width [SI] of the 95 % band of a predicted quantity, and the rows or groups that it comes from."""

    quantity: str
    half_width: float
    """For further records of the measured specimens."""
    source: str
    held_half_width: float | None = None
    """For isometric runs; None where it is the same."""
    specimens: tuple[str, ...] = ()
    """The measured specimens; empty where they are not known."""
    resting_lengths: tuple[float, ...] = ()
    """Their resting lengths [m]; empty where they are not known."""
    new_specimen_half_width: float | None = None
    """For specimens that were not measured; None where it is not known."""
    new_specimen_source: str = ""
    """The specimens left out of the fit that it comes from."""
    max_contraction_rate: float | None = None
    """Maximum rate of the contraction in the records of the fit [1/s]; None where it is not known."""
    max_pressure_rate: float | None = None
    """Maximum rate of the pressure in the records of the fit [Pa/s]; None where it is not known."""

    def __post_init__(self) -> None:
        if self.quantity not in PREDICTED:
            raise ParameterError(f"StatedBand: quantity is '{self.quantity}'; allowed are {', '.join(PREDICTED)}.")
        for name in WIDTHS:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"StatedBand: {name} is {value:g}; it must be finite and positive.")
        for name, value in [*((n, getattr(self, n)) for n in RATES), *(("length", x) for x in self.resting_lengths)]:
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"StatedBand: {name} is {value:g}; it must be finite and not negative.")


def read_stated_band(table: Any, location: Location) -> StatedBand:
    """The band of a table [error_band]. Raises ParameterError or UnitError with the location."""
    if not isinstance(table, Mapping):
        raise ParameterError(f"{location} is {table!r}; it must be a table with {', '.join(KEYS)}.")
    check_keys(table, KEYS, location)
    quantity = read_text(table, "quantity", location, needed=True)
    unit = QUANTITIES[quantity].unit if quantity in PREDICTED else "1"
    if "half_width" not in table:
        raise ParameterError(f"{location}: 'half_width' is missing; give the half width of the 95 % band.")
    units = {**dict.fromkeys(WIDTHS, unit), **RATES}
    numbers: dict[str, Any] = {
        key: read_finite_number(table[key], units[key], f"{location}, {key}") for key in units if key in table
    }
    lengths = _read_list(table, "resting_lengths", location)
    place = f"{location}, resting_lengths"
    try:
        return StatedBand(
            quantity,
            source=read_text(table, "source", location, needed=False),
            new_specimen_source=read_text(table, "new_specimen_source", location, needed=False),
            specimens=tuple(str(name) for name in _read_list(table, "specimens", location)),
            resting_lengths=tuple(read_finite_number(length, "m", place) for length in lengths),
            **numbers,
        )
    except ParameterError as error:
        raise error.located(location) from None


def _read_list(table: Mapping[str, Any], key: str, location: Location) -> list[Any]:
    """A list of a table; empty if it is missing. Raises ParameterError."""
    items = table.get(key, [])
    if not isinstance(items, list):
        raise ParameterError(f"{location}, {key} is {items!r}; it must be a list.")
    return items
