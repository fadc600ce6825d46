"""Gas models of higher accuracy: virial equation of state, heat transfer coefficient of the
wall.
"""

from typing import ClassVar

from ...core import Reference, Value, Values, model, ops, parameter, published
from .gas import GAS_CONSTANT, HEAT_CAPACITY_RATIO, Air, Ambient, BarotropicGas, FirstLawGas

_COMPRESSIBILITY = (1.58123e-6, -2.9331e-8, 1.1043e-10)
"""a_0 [K/Pa], a_1 [1/Pa] and a_2 [1/(K Pa)] of Z = 1 - p/T (a_0 + a_1 t + a_2 t^2) + ..., t in
degrees Celsius.
"""


def virial_coefficient_of_air(temperature: float) -> float:
    """Second virial coefficient B [m3/kg] of dry air at a temperature [K]: B = -R (a_0 + a_1 t +
    a_2 t^2).

    t temperature in degrees Celsius; a_0 to a_2 of the compressibility in CIPM-2007, fitted from 15
    to 27 degrees Celsius. At 20 degrees -2.98e-4 m3/kg or -8.64 cm3/mol; outside of 0 to 60 degrees
    it is an extrapolation.
    """
    celsius = temperature - 273.15
    a_0, a_1, a_2 = _COMPRESSIBILITY
    return -GAS_CONSTANT * (a_0 + a_1 * celsius + a_2 * celsius**2)


@model
class VirialGas(BarotropicGas):
    """Isothermal real gas: p = rho R T_amb (1 + B rho), with the second virial coefficient B and
    rho = m/V.

    B = 0 is the ideal gas. The default is that of dry air at 293.15 K;
    `virial_coefficient_of_air(T)` is that at another ambient temperature. Reference: CIPM-2007
    (Picard et al. 2008).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("cipm-2007"),)

    virial_coefficient: float = parameter(
        "m3/kg",
        "B",
        "second virial coefficient of air",
        bounds=(-5e-3, 5e-3),
        fitted=False,
        default=virial_coefficient_of_air(293.15),
    )

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        density = air_mass / volume
        return (
            density
            * (GAS_CONSTANT * ambient.temperature)
            * (1.0 + self.virial_coefficient * density)
        )

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        ideal = pressure / (GAS_CONSTANT * ambient.temperature)
        return volume * self._density(ideal)

    def _density(self, ideal: Value) -> Value:
        """Density [kg/m3] at the pressure at which an ideal gas has the density `ideal`; the root
        near the latter.
        """
        return 2.0 * ideal / (1.0 + ops.sqrt(1.0 + 4.0 * self.virial_coefficient * ideal))

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        thermal = GAS_CONSTANT * ambient.temperature
        density = air_mass / volume
        return (
            air_mass
            * thermal
            * (
                ops.log(density * thermal / ambient.pressure)
                - 1.0
                + self.virial_coefficient * density
            )
        )

    def sound_speed(self, air: Air) -> Value:
        density = self._density(air.pressure / (GAS_CONSTANT * air.temperature))
        return ops.sqrt(
            GAS_CONSTANT * air.temperature * (1.0 + 2.0 * self.virial_coefficient * density)
        )


SURFACE_FACTOR = 9.405044
"""Surface over volume to the power 2/3, pi (r + 1/2) (4/(pi r))^(2/3), of a cylinder of r = 15
diameters (chosen).
"""


@model
class WallHeatTransfer(FirstLawGas):
    """Energy balance with Q' = h A (T_amb - T), a heat transfer coefficient h over the surface A of
    each chamber.

        A = pi D^2 (r + 1/2)   with   V = pi D^2 r D/4

    A is the surface of a cylinder of the volume V of the chamber that is r = 15 times as long as
    wide (chosen), as the DMSP-20-300; a cylinder of 5 to 60 diameters has 0.7 to 1.6 times this
    surface. The default of h (chosen) is within the values that follow from three measured fills of
    a 20 mm muscle by hA/V = 4 h/D, 18 to 36 W/(m2 K) (benchmarks/REAL_DATA.md), and that of natural
    convection in a tube of this size.
    """

    coefficient: float = parameter(
        "W/(m2 K)", "h", "heat transfer coefficient of the wall", bounds=(0.0, 1e4), default=25.0
    )

    def heat_flow(self, state: Values, air: Air, ambient: Ambient) -> Value:
        volume = (HEAT_CAPACITY_RATIO - 1.0) * state["internal_energy"] / air.pressure
        return (
            self.coefficient
            * SURFACE_FACTOR
            * volume ** (2.0 / 3.0)
            * (ambient.temperature - air.temperature)
        )


DEFAULT_GAS = WallHeatTransfer()
"""Gas of a plant that states none."""
