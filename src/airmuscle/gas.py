"""Dry ideal air: how gauge becomes absolute, and how air mass and volume give pressure.

Air mass is the state of a chamber, so that mass is conserved whatever the tolerance; pressure follows from it.
"""

from __future__ import annotations

import abc
from typing import ClassVar

from . import ops
from .declare import model, parameter
from .errors import ParameterError
from .ops import Value
from .reference import Reference
from .units import ABSOLUTE, AMBIENT_PRESSURE

GAS_CONSTANT = 287.05
"""Specific gas constant of dry air [J/(kg K)]."""
REFERENCE_DENSITY = 1.185
"""Density of air at the reference atmosphere of ISO 8778, 100 kPa and 293.15 K [kg/m3]."""
REFERENCE_TEMPERATURE = 293.15
"""Temperature of that reference atmosphere [K]."""

ISO8778 = Reference(
    "iso-8778", "ISO", "Fluid power: standard reference atmosphere", "ISO 8778", 2003,
    note="100 kPa, 293.15 K, 1.185 kg/m3",
)  # fmt: skip


@model
class Ambient:
    """The air around the muscle."""

    references: ClassVar[tuple[Reference, ...]] = (ISO8778,)

    pressure: float = parameter(
        ABSOLUTE,
        "p_amb",
        "absolute pressure of the surroundings",
        bounds=(1e3, 2e5),
        fitted=False,
        default=AMBIENT_PRESSURE,
    )
    temperature: float = parameter(
        "K", "T_amb", "temperature of the surroundings", bounds=(200.0, 400.0), fitted=False, default=293.15
    )


def absolute(pressure: Value, ambient: Ambient) -> Value:
    """Absolute pressure [Pa] from gauge pressure [Pa]; the one place where gauge becomes absolute."""
    return pressure + ambient.pressure


def gauge(pressure: Value, ambient: Ambient) -> Value:
    """Gauge pressure [Pa] from absolute pressure [Pa]."""
    return pressure - ambient.pressure


def refuse_vacuum(pressure: float, ambient: Ambient) -> None:
    """Raise ParameterError for a gauge pressure [Pa] at or below absolute zero."""
    if not absolute(pressure, ambient) > 0:
        raise ParameterError(
            f"a gauge pressure of {pressure / 1e3:.6g} kPa lies below absolute zero "
            f"({-ambient.pressure / 1e3:.6g} kPa gauge). Is it in another unit?"
        )


class Gas(abc.ABC):
    """How the air in a chamber takes up pressure: its equation of state along a process."""

    @abc.abstractmethod
    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Absolute pressure [Pa] of an air mass [kg] in a volume [m3]."""

    @abc.abstractmethod
    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        """Air mass [kg] that has an absolute pressure [Pa] in a volume [m3]."""

    @abc.abstractmethod
    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Energy [J] that the air can give along this process; its slope by volume is minus the absolute pressure."""


@model
class Isothermal(Gas):
    """Boyle-Mariotte: p V = m R T at the ambient temperature, as in the paper of Hosovsky et al."""

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return air_mass * (GAS_CONSTANT * ambient.temperature) / volume

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        return pressure * volume / (GAS_CONSTANT * ambient.temperature)

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        ratio = self.pressure(air_mass, volume, ambient) / ambient.pressure
        return air_mass * GAS_CONSTANT * ambient.temperature * (ops.log(ratio) - 1.0)


@model
class Polytropic(Gas):
    """p / rho^n constant along the process, through the state of the ambient air.

        p = p_amb (m R T_amb / (p_amb V))^n,   so that   p' = n (R T m' - p V') / V   with T = p V / (m R)

    n towards 1 is isothermal, 1.4 adiabatic. The process passes through ambient pressure and temperature; air that has
    cooled down at a higher pressure is not described by it.
    """

    exponent: float = parameter("1", "n", "polytropic exponent", bounds=(1.001, 1.667), default=1.2)

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        density_ratio = air_mass * (GAS_CONSTANT * ambient.temperature / ambient.pressure) / volume
        return ambient.pressure * density_ratio**self.exponent

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        density = ambient.pressure / (GAS_CONSTANT * ambient.temperature)
        return density * volume * (pressure / ambient.pressure) ** (1.0 / self.exponent)

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return self.pressure(air_mass, volume, ambient) * volume / (self.exponent - 1.0)
