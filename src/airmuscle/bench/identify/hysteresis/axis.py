"""Axis of the path of a friction: label, units, and conversion of parameters to them."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Axis:
    """The axis on which a path [m] is plotted: its label, and the factor from metres to its unit.

    `si_unit` is the SI unit of the driving quantity, of which `si_factor` correspond to a metre.
    """

    label: str
    factor: float
    si_unit: str = "m"
    si_factor: float = 1.0

    def display(self, value: float, unit: str) -> tuple[float, str]:
        """The value and unit of a parameter of the friction with the driving quantity in place of the displacement."""
        if self.si_unit == "m":
            return value, "" if unit == "1" else unit
        conversions = {
            "m": (value * self.si_factor, self.si_unit),
            "m/s": (value * self.si_factor, f"{self.si_unit}/s"),
            "N/m": (value / self.si_factor, f"N/{self.si_unit}"),
            "N s/m": (value / self.si_factor, f"N s/{self.si_unit}"),
            "1": (value, ""),
        }
        return conversions.get(unit, (value, unit))


MILLIMETRES = Axis("displacement [mm]", 1e3)
