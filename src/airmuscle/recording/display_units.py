"""Display units: the units in which quantities are plotted and printed."""

from __future__ import annotations

from .columns import quantity_of

_DISPLAY_UNITS = {
    "pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "length": (1e3, "mm"), "position": (1e3, "mm"),
    "volume": (1e6, "cm³"), "air_mass": (1e3, "g"), "mass_flow": (1e3, "g/s"),
}  # fmt: skip
"""Factor and unit of the quantities that are not displayed in SI units."""


def display_scale(name: str) -> tuple[float, str]:
    """Factor and unit in which a column is displayed; the unit is empty for an unknown quantity."""
    quantity = quantity_of(name)
    if quantity is None:
        return 1.0, ""
    return _DISPLAY_UNITS.get(name.rpartition(".")[2], (1.0, "-" if quantity.unit == "1" else quantity.unit))
