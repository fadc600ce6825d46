"""Stated band of a muscle file: the half width of the 95 % band of the quantity that its law predicts."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ..core.errors import ParameterError
from ..recording.columns import QUANTITIES
from .location import Location, check_keys, read_finite_number, read_text

KEYS = ("quantity", "half_width", "source")
"""Keys of the table [error_band]."""
PREDICTED = ("force", "contraction", "pressure")
"""Quantities that a law may give."""


@dataclasses.dataclass(frozen=True)
class StatedBand:
    """The half width [SI] of the 95 % band of a predicted quantity, and the rows or groups that it comes from."""

    quantity: str
    half_width: float
    source: str

    def __post_init__(self) -> None:
        if self.quantity not in PREDICTED:
            raise ParameterError(f"StatedBand: quantity is '{self.quantity}'; allowed are {', '.join(PREDICTED)}.")
        if not (math.isfinite(self.half_width) and self.half_width > 0.0):
            raise ParameterError(f"StatedBand: half_width is {self.half_width:g}; it must be finite and positive.")


def read_stated_band(table: Any, location: Location) -> StatedBand:
    """The band of a table [error_band]. Raises ParameterError or UnitError with the location."""
    if not isinstance(table, Mapping):
        raise ParameterError(f"{location} is {table!r}; it must be a table with {', '.join(KEYS)}.")
    check_keys(table, KEYS, location)
    quantity = read_text(table, "quantity", location, needed=True)
    unit = QUANTITIES[quantity].unit if quantity in PREDICTED else "1"
    if "half_width" not in table:
        raise ParameterError(f"{location}: 'half_width' is missing; give the half width of the 95 % band.")
    half_width = read_finite_number(table["half_width"], unit, f"{location}, half_width")
    try:
        return StatedBand(quantity, half_width, read_text(table, "source", location, needed=False) or "")
    except ParameterError as error:
        raise error.located(location) from None
