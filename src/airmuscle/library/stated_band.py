"""Stated band of a muscle file: the half width of the 95 % band of the quantity that its law predicts."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ..core.errors import ParameterError
from ..recording.columns import QUANTITIES
from .location import Location, check_keys, read_finite_number, read_text

KEYS = ("quantity", "half_width", "source", "held_half_width")
"""Keys of the table [error_band]."""
PREDICTED = ("force", "contraction", "pressure")
"""Quantities that a law may give."""


@dataclasses.dataclass(frozen=True)
class StatedBand:
    """The half width [SI] of the 95 % band of a predicted quantity, and the rows or groups that it comes from.

    `held_half_width` is that for isometric runs, None where it is the same.
    """

    quantity: str
    half_width: float
    source: str
    held_half_width: float | None = None

    def __post_init__(self) -> None:
        if self.quantity not in PREDICTED:
            raise ParameterError(f"StatedBand: quantity is '{self.quantity}'; allowed are {', '.join(PREDICTED)}.")
        for name in ("half_width", "held_half_width"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"StatedBand: {name} is {value:g}; it must be finite and positive.")


def read_stated_band(table: Any, location: Location) -> StatedBand:
    """The band of a table [error_band]. Raises ParameterError or UnitError with the location."""
    if not isinstance(table, Mapping):
        raise ParameterError(f"{location} is {table!r}; it must be a table with {', '.join(KEYS)}.")
    check_keys(table, KEYS, location)
    quantity = read_text(table, "quantity", location, needed=True)
    unit = QUANTITIES[quantity].unit if quantity in PREDICTED else "1"
    if "half_width" not in table:
        raise ParameterError(f"{location}: 'half_width' is missing; give the half width of the 95 % band.")
    half, held = (
        read_finite_number(table[key], unit, f"{location}, {key}") if key in table else None
        for key in ("half_width", "held_half_width")
    )
    assert half is not None
    try:
        return StatedBand(quantity, half, read_text(table, "source", location, needed=False) or "", held)
    except ParameterError as error:
        raise error.located(location) from None
