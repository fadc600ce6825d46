"""Dry ideal air: how gauge becomes absolute, and how what a chamber holds gives its pressure.

Air mass is the state of a chamber, so that mass is conserved whatever the tolerance; pressure follows from it.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

from ..core import autodiff, ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..core.units import ABSOLUTE, AMBIENT_PRESSURE
from ..core.variables import StateVariable

GAS_CONSTANT = 287.05
"""Specific gas constant of dry air [J/(kg K)]."""
HEAT_CAPACITY_RATIO = 1.4
"""Ratio of the specific heats of a diatomic ideal gas, as dry air is taken for here."""
SPECIFIC_HEAT_CONSTANT_VOLUME = GAS_CONSTANT / (HEAT_CAPACITY_RATIO - 1.0)
"""Specific heat c_v of dry air [J/(kg K)]."""
SPECIFIC_HEAT_CONSTANT_PRESSURE = HEAT_CAPACITY_RATIO * SPECIFIC_HEAT_CONSTANT_VOLUME
"""Specific heat c_p of dry air [J/(kg K)]."""
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


def absolute_pressure(pressure: Value, ambient: Ambient) -> Value:
    """Absolute pressure [Pa] from gauge pressure [Pa]; the one place where gauge becomes absolute."""
    return pressure + ambient.pressure


def gauge_pressure(pressure: Value, ambient: Ambient) -> Value:
    """Gauge pressure [Pa] from absolute pressure [Pa]."""
    return pressure - ambient.pressure


def check_above_vacuum(pressure: float, ambient: Ambient) -> None:
    """Raise ParameterError for a gauge pressure [Pa] at or below absolute zero."""
    if not absolute_pressure(pressure, ambient) > 0:
        raise ParameterError(
            f"a gauge pressure of {pressure / 1e3:.6g} kPa lies below absolute zero "
            f"({-ambient.pressure / 1e3:.6g} kPa gauge). Is it in another unit?"
        )


class Air(NamedTuple):
    """Air at one place: absolute pressure [Pa] and temperature [K]."""

    pressure: Value
    temperature: Value


@dataclasses.dataclass(frozen=True)
class Flow:
    """Air on its way: mass flow [kg/s], and the enthalpy that it carries, c_p T m' [W]."""

    mass: Value
    enthalpy: Value

    def __add__(self, other: Flow) -> Flow:
        return Flow(self.mass + other.mass, self.enthalpy + other.enthalpy)

    def __sub__(self, other: Flow) -> Flow:
        return Flow(self.mass - other.mass, self.enthalpy - other.enthalpy)

    def __neg__(self) -> Flow:
        return Flow(-self.mass, -self.enthalpy)


NO_FLOW = Flow(0.0, 0.0)
"""No air moves."""


class Gas(abc.ABC):
    """How the air in a chamber takes up pressure. What a chamber holds is a mapping by the names of `states`."""

    references: ClassVar[tuple[Reference, ...]] = ()

    @abc.abstractmethod
    def states(self, volume: Value, ambient: Ambient) -> tuple[StateVariable, ...]:
        """The states of a chamber of about this volume [m3], `air_mass` first."""

    @abc.abstractmethod
    def air(self, content: Mapping[str, Value], volume: Value, ambient: Ambient) -> Air:
        """Pressure and temperature of what a chamber holds, in a volume [m3]."""

    @abc.abstractmethod
    def state_at(self, pressure: Value, volume: Value, ambient: Ambient) -> dict[str, Value]:
        """What a volume [m3] holds at rest at an absolute pressure [Pa]."""

    @abc.abstractmethod
    def rates(
        self, content: Mapping[str, Value], air: Air, flow: Flow, volume_rate: Value, ambient: Ambient
    ) -> dict[str, Value]:
        """The time derivative of every state, as air flows in and the volume grows at `volume_rate` [m3/s]."""

    @abc.abstractmethod
    def available_energy(self, content: Mapping[str, Value], volume: Value, ambient: Ambient) -> Value:
        """Energy [J] that the chamber can give; along the process its slope by volume is minus the pressure."""

    @abc.abstractmethod
    def energy_flow(self, content: Mapping[str, Value], flow: Flow, volume: Value, ambient: Ambient) -> Value:
        """Power [W] that comes in with the flow."""

    @abc.abstractmethod
    def sound_speed(self, air: Air) -> Value:
        """Speed [m/s] at which a small disturbance travels: sqrt(dp/drho) along the process."""

    def heat_flow(self, air: Air, ambient: Ambient) -> Value:
        """Heat [W] that the wall gives to the air, where the gas keeps account of it."""
        return 0.0


class BarotropicGas(Gas):
    """Air that keeps to one process, so that its mass and volume alone give its pressure."""

    @abc.abstractmethod
    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Absolute pressure [Pa] of an air mass [kg] in a volume [m3]."""

    @abc.abstractmethod
    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        """Air mass [kg] that has an absolute pressure [Pa] in a volume [m3]."""

    @abc.abstractmethod
    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Energy [J] that the air can give along this process; its slope by volume is minus the absolute pressure."""

    @abc.abstractmethod
    def temperature(self, pressure: Value, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Temperature [K] of an air mass [kg] that has an absolute pressure [Pa] in a volume [m3]."""

    def states(self, volume: Value, ambient: Ambient) -> tuple[StateVariable, ...]:
        size = self.air_mass(ambient.pressure, volume, ambient)
        return (StateVariable("air_mass", "kg", size, "mass of the air"),)

    def air(self, content: Mapping[str, Value], volume: Value, ambient: Ambient) -> Air:
        pressure = self.pressure(content["air_mass"], volume, ambient)
        return Air(pressure, self.temperature(pressure, content["air_mass"], volume, ambient))

    def state_at(self, pressure: Value, volume: Value, ambient: Ambient) -> dict[str, Value]:
        return {"air_mass": self.air_mass(pressure, volume, ambient)}

    def rates(
        self, content: Mapping[str, Value], air: Air, flow: Flow, volume_rate: Value, ambient: Ambient
    ) -> dict[str, Value]:
        return {"air_mass": flow.mass}

    def available_energy(self, content: Mapping[str, Value], volume: Value, ambient: Ambient) -> Value:
        return self.energy(content["air_mass"], volume, ambient)

    def energy_flow(self, content: Mapping[str, Value], flow: Flow, volume: Value, ambient: Ambient) -> Value:
        per_mass = autodiff.jvp(lambda x: [self.energy(x[0], volume, ambient)], [content["air_mass"]], [1.0])
        return per_mass[0] * flow.mass


@model
class Isothermal(BarotropicGas):
    """Boyle-Mariotte: p V = m R T at the ambient temperature, as in the paper of Hosovsky et al."""

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return air_mass * (GAS_CONSTANT * ambient.temperature) / volume

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        return pressure * volume / (GAS_CONSTANT * ambient.temperature)

    def temperature(self, pressure: Value, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return ambient.temperature

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        ratio = self.pressure(air_mass, volume, ambient) / ambient.pressure
        return air_mass * GAS_CONSTANT * ambient.temperature * (ops.log(ratio) - 1.0)

    def sound_speed(self, air: Air) -> Value:
        return ops.sqrt(GAS_CONSTANT * air.temperature)


@model
class Polytropic(BarotropicGas):
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

    def temperature(self, pressure: Value, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return pressure * volume / (air_mass * GAS_CONSTANT)

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return self.pressure(air_mass, volume, ambient) * volume / (self.exponent - 1.0)

    def sound_speed(self, air: Air) -> Value:
        return ops.sqrt(self.exponent * GAS_CONSTANT * air.temperature)


@model
class EnergyBalance(Gas):
    """First law for the air in a chamber, with heat from its wall, which stays at ambient temperature.

        m' = sum m'_i,   U' = sum c_p T_i m'_i - p V' + hA (T_amb - T),   T = U/(m c_v),   p = (gamma - 1) U/V

    m air mass, U internal energy, T_i the temperature of the air where each flow comes from, hA heat that passes the
    wall for each kelvin. hA = 0 is adiabatic, a large hA isothermal. Dry ideal air, gamma = 1.4.
    """

    heat_transfer: float = parameter("W/K", "hA", "heat transfer between air and wall", bounds=(0.0, 1e5))

    def states(self, volume: Value, ambient: Ambient) -> tuple[StateVariable, ...]:
        rest = self.state_at(ambient.pressure, volume, ambient)
        return (
            StateVariable("air_mass", "kg", rest["air_mass"], "mass of the air"),
            StateVariable("internal_energy", "J", rest["internal_energy"], "internal energy of the air"),
        )

    def air(self, content: Mapping[str, Value], volume: Value, ambient: Ambient) -> Air:
        energy = content["internal_energy"]
        temperature = energy / (content["air_mass"] * SPECIFIC_HEAT_CONSTANT_VOLUME)
        return Air((HEAT_CAPACITY_RATIO - 1.0) * energy / volume, temperature)

    def state_at(self, pressure: Value, volume: Value, ambient: Ambient) -> dict[str, Value]:
        return {
            "air_mass": pressure * volume / (GAS_CONSTANT * ambient.temperature),
            "internal_energy": pressure * volume / (HEAT_CAPACITY_RATIO - 1.0),
        }

    def rates(
        self, content: Mapping[str, Value], air: Air, flow: Flow, volume_rate: Value, ambient: Ambient
    ) -> dict[str, Value]:
        energy = flow.enthalpy - air.pressure * volume_rate + self.heat_flow(air, ambient)
        return {"air_mass": flow.mass, "internal_energy": energy}

    def available_energy(self, content: Mapping[str, Value], volume: Value, ambient: Ambient) -> Value:
        return content["internal_energy"]

    def energy_flow(self, content: Mapping[str, Value], flow: Flow, volume: Value, ambient: Ambient) -> Value:
        return flow.enthalpy

    def sound_speed(self, air: Air) -> Value:
        """That of adiabatic sound; a heat transfer that is large within a period brings it down to the isothermal."""
        return ops.sqrt(HEAT_CAPACITY_RATIO * GAS_CONSTANT * air.temperature)

    def heat_flow(self, air: Air, ambient: Ambient) -> Value:
        return self.heat_transfer * (ambient.temperature - air.temperature)
