"""Energy balance of the air with a heat transfer coefficient of the wall, the default gas of a plant."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import model, parameter
from ...core.ops import Value
from .gas import HEAT_CAPACITY_RATIO, Air, Ambient, FirstLawGas

SURFACE_FACTOR = 9.405044
"""Surface over volume to the power 2/3, pi (r + 1/2) (4/(pi r))^(2/3), of a cylinder of r = 15 diameters (chosen)."""


@model
class WallHeatTransfer(FirstLawGas):
    """Energy balance with Q' = h A (T_amb - T), a heat transfer coefficient h over the surface A of each chamber.

        A = pi D^2 (r + 1/2)   with   V = pi D^2 r D/4

    A is the surface of a cylinder of the volume V of the chamber that is r = 15 times as long as wide (chosen), as the
    DMSP-20-300; a cylinder of 5 to 60 diameters has 0.7 to 1.6 times this surface. The default of h (chosen) is within
    the values that follow from three measured fills of a 20 mm muscle by hA/V = 4 h/D, 18 to 36 W/(m2 K)
    (benchmarks/REAL_DATA.md), and that of natural convection in a tube of this size.
    """

    coefficient: float = parameter(
        "W/(m2 K)", "h", "heat transfer coefficient of the wall", bounds=(0.0, 1e4), default=25.0
    )

    def heat_flow(self, state: Mapping[str, Value], air: Air, ambient: Ambient) -> Value:
        volume = (HEAT_CAPACITY_RATIO - 1.0) * state["internal_energy"] / air.pressure
        return self.coefficient * SURFACE_FACTOR * volume ** (2.0 / 3.0) * (ambient.temperature - air.temperature)


DEFAULT_GAS = WallHeatTransfer()
"""Gas of a plant that states none."""
