"""Display units: the units in which quantities are plotted and printed."""

from __future__ import annotations

from ..core.display import chosen_scale
from .columns import quantity_of

_DISPLAY_UNITS = {
    "pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "length": (1e3, "mm"), "position": (1e3, "mm"),
    "shortening": (1e3, "mm"),
    "volume": (1e6, "cm³"), "air_mass": (1e3, "g"), "mass_flow": (1e3, "g/s"),
}  # fmt: skip
"""Factor and unit of the quantities that are not displayed in SI units."""


def display_scale(name: str) -> tuple[float, str]:
    """Factor and unit in which a column is displayed, chosen or usual; the unit is empty for an unknown quantity.

    Raises FileError or UnitError for an invalid configuration file.
    """
    quantity = quantity_of(name)
    if quantity is None:
        return 1.0, ""
    usual = _DISPLAY_UNITS.get(name.rpartition(".")[2], (1.0, "-" if quantity.unit == "1" else quantity.unit))
    if quantity.unit == "1" and usual[1] != "%":  # an opening is not a contraction
        return usual
    factor, unit = chosen_scale(quantity.unit, *usual)
    return factor, "-" if unit == "1" else unit


def displayed(name: str, value: float, digits: int = 4) -> str:
    """A value [SI] of a column as text in the unit in which the column is displayed, such as "5.309 kPa"."""
    factor, unit = display_scale(name)
    return f"{value * factor:.{digits}g} {unit}".removesuffix(" -").rstrip()
