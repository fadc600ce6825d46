"""Real gas at ambient temperature: virial equation of state with the second coefficient."""

from __future__ import annotations

from typing import ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from .gas import GAS_CONSTANT, Air, Ambient, BarotropicGas

VAN_DER_WAALS = Reference(
    "van-der-waals",
    "W. M. Haynes (ed.)",
    "CRC Handbook of Chemistry and Physics, van der Waals constants for gases",
    "CRC Press",
    note="nitrogen: a = 0.1370 Pa m6/mol2, b = 3.87e-5 m3/mol, 28.013 g/mol",
)
NITROGEN_VIRIAL_COEFFICIENT = (3.87e-5 - 0.1370 / (8.314463 * 293.15)) / 0.028013
"""Second virial coefficient b - a/(R T) of the van der Waals equation [m3/kg]: nitrogen for air, at 293.15 K."""


@model
class VirialGas(BarotropicGas):
    """Isothermal real gas: p = rho R T_amb (1 + B rho), with the second virial coefficient B and rho = m/V.

    B = 0 is the ideal gas. The default is that of the van der Waals equation, B = b - a/(R T), with the constants of
    nitrogen at 293.15 K. Reference: CRC Handbook of Chemistry and Physics, van der Waals constants.
    """

    references: ClassVar[tuple[Reference, ...]] = (VAN_DER_WAALS,)

    virial_coefficient: float = parameter(
        "m3/kg", "B", "second virial coefficient of air", bounds=(-5e-3, 5e-3), fitted=False,
        default=NITROGEN_VIRIAL_COEFFICIENT,
    )  # fmt: skip

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        density = air_mass / volume
        return density * (GAS_CONSTANT * ambient.temperature) * (1.0 + self.virial_coefficient * density)

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        ideal = pressure / (GAS_CONSTANT * ambient.temperature)
        return volume * self._density(ideal)

    def _density(self, ideal: Value) -> Value:
        """Density [kg/m3] at the pressure at which an ideal gas has the density `ideal`; the root near the latter."""
        return 2.0 * ideal / (1.0 + ops.sqrt(1.0 + 4.0 * self.virial_coefficient * ideal))

    def temperature(self, pressure: Value, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return ambient.temperature

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        thermal = GAS_CONSTANT * ambient.temperature
        density = air_mass / volume
        return air_mass * thermal * (ops.log(density * thermal / ambient.pressure) - 1.0
                                     + self.virial_coefficient * density)  # fmt: skip

    def sound_speed(self, air: Air) -> Value:
        density = self._density(air.pressure / (GAS_CONSTANT * air.temperature))
        return ops.sqrt(GAS_CONSTANT * air.temperature * (1.0 + 2.0 * self.virial_coefficient * density))
