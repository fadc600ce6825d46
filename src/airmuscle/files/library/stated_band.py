"""Stated band of a muscle file: half widths of the 95 % band of the predicted quantity, and its records."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ...core.annotation import check_field_types
from ...core.declaration import parameter
from ...core.errors import ParameterError, suggestion
from ...recording.columns import QUANTITIES

PREDICTED = ("force", "contraction", "pressure")
"""Quantities that a law may give."""
WIDTHS = ("half_width", "held_half_width", "new_specimen_half_width")
"""The half widths, in the unit of the quantity."""


def _width(meaning: str, **field: Any) -> Any:
    return parameter("1", "h", meaning, **field)


@dataclasses.dataclass(frozen=True)
class StatedBand:
    """The half width [SI] of the 95 % band of a predicted quantity, and the rows or groups that it comes from."""

    quantity: str
    half_width: float = _width("half width of the 95 % band for further records of the measured specimens")
    source: str = ""
    held_half_width: float | None = _width("half width for isometric runs, if it differs", default=None)
    specimens: tuple[str, ...] = ()
    """The measured specimens; empty where they are not known."""
    resting_lengths: tuple[float, ...] = parameter("m", "L_0", "their resting lengths, if known", default=())
    new_specimen_half_width: float | None = _width("half width for other specimens, if known", default=None)
    new_specimen_source: str = ""
    """The specimens left out of the fit that it comes from."""
    max_contraction_rate: float | None = parameter(
        "1/s", "deps_max", "maximum rate of the contraction in the records of the fit, if known", default=None
    )
    max_pressure_rate: float | None = parameter(
        "Pa/s", "dp_max", "maximum rate of the pressure in the records of the fit, if known", default=None
    )

    def __post_init__(self) -> None:
        check_field_types(self)
        if self.quantity not in PREDICTED:
            raise ParameterError(
                f"StatedBand: quantity is '{self.quantity}'; allowed are {', '.join(PREDICTED)}."
                f"{suggestion(self.quantity, PREDICTED)}"
            )
        for name in WIDTHS:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"StatedBand: {name} is {value:g}; it must be finite and positive.")
        rates = ((name, getattr(self, name)) for name in ("max_contraction_rate", "max_pressure_rate"))
        for name, value in (*rates, *(("length", length) for length in self.resting_lengths)):
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"StatedBand: {name} is {value:g}; it must be finite and not negative.")

    @staticmethod
    def units_of_table(table: Mapping[str, Any]) -> dict[str, str]:
        """The units of the numbers of a table that depend on its quantity."""
        quantity = table.get("quantity")
        return dict.fromkeys(WIDTHS, QUANTITIES[quantity].unit if quantity in PREDICTED else "1")
