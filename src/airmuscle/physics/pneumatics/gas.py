"""Gas models of dry ideal air: pressure and temperature of a chamber; gauge and absolute pressure.

The state of a chamber is its air mass, from which the pressure follows, so that mass is conserved
independently of the integration tolerance.
"""

import abc
import dataclasses
from typing import ClassVar, NamedTuple

from ...core import (
    Reference,
    StateVariable,
    Value,
    Values,
    autodiff,
    model,
    ops,
    parameter,
    published,
)
from ...core.units import ABSOLUTE, AMBIENT_PRESSURE

GAS_CONSTANT = 287.05
"""Specific gas constant of dry air [J/(kg K)]."""
HEAT_CAPACITY_RATIO = 1.4
"""Ratio of the specific heats of dry air, taken as a diatomic ideal gas."""
SPECIFIC_HEAT_CONSTANT_VOLUME = GAS_CONSTANT / (HEAT_CAPACITY_RATIO - 1.0)
"""Specific heat c_v of dry air [J/(kg K)]."""
SPECIFIC_HEAT_CONSTANT_PRESSURE = HEAT_CAPACITY_RATIO * SPECIFIC_HEAT_CONSTANT_VOLUME
"""Specific heat c_p of dry air [J/(kg K)]."""
REFERENCE_DENSITY = 1.185
"""Density of air at the reference atmosphere of ISO 8778, 100 kPa and 293.15 K [kg/m3]."""
REFERENCE_TEMPERATURE = 293.15
"""Temperature of the reference atmosphere of ISO 8778 [K]."""


@model
class Ambient:
    """Ambient air: absolute pressure and temperature of the surroundings."""

    references: ClassVar[tuple[Reference, ...]] = (published("iso-8778"),)

    pressure: float = parameter(
        ABSOLUTE,
        "p_amb",
        "absolute pressure of the surroundings",
        bounds=(1e3, 2e5),
        fitted=False,
        default=AMBIENT_PRESSURE,
    )
    temperature: float = parameter(
        "K",
        "T_amb",
        "temperature of the surroundings",
        bounds=(200.0, 400.0),
        fitted=False,
        default=293.15,
    )


def absolute_pressure(pressure: Value, ambient: Ambient) -> Value:
    """Absolute pressure [Pa] from gauge pressure [Pa]; the only such conversion in the package."""
    return pressure + ambient.pressure


def gauge_pressure(pressure: Value, ambient: Ambient) -> Value:
    """Gauge pressure [Pa] from absolute pressure [Pa]."""
    return pressure - ambient.pressure


class Air(NamedTuple):
    """Air state: absolute pressure [Pa] and temperature [K]."""

    pressure: Value
    temperature: Value


Airs = tuple[Air, ...]
"""Air states of muscles, or of the segments of a tube."""


def upstream_temperature(first: Air, second: Air, forward: Value) -> Value:
    """Temperature [K] of air that flows from `first` to `second` where `forward`, otherwise in the
    other direction.
    """
    if second.temperature is first.temperature:
        return first.temperature  # avoids a selection between two equal temperatures
    return ops.where(forward, first.temperature, second.temperature)


@dataclasses.dataclass(frozen=True)
class Flow:
    """Air flow: mass flow [kg/s] and enthalpy flow c_p T m' [W]."""

    mass: Value
    enthalpy: Value

    @classmethod
    def at(cls, temperature: Value, mass: Value) -> "Flow":
        """The flow of air of a temperature [K]."""
        return cls(mass, SPECIFIC_HEAT_CONSTANT_PRESSURE * temperature * mass)

    def __add__(self, other: "Flow") -> "Flow":
        return Flow(self.mass + other.mass, self.enthalpy + other.enthalpy)

    def __sub__(self, other: "Flow") -> "Flow":
        return Flow(self.mass - other.mass, self.enthalpy - other.enthalpy)

    def __neg__(self) -> "Flow":
        return Flow(-self.mass, -self.enthalpy)


NO_FLOW = Flow(0.0, 0.0)
"""Zero flow."""


class Gas(abc.ABC):
    """Gas model of the air in a chamber (interface). A state is a mapping from the names in
    `states` to values.
    """

    references: ClassVar[tuple[Reference, ...]] = ()

    @abc.abstractmethod
    def states(self, volume: Value, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables of a chamber, `air_mass` first; the volume [m3] sets their nominal
        values.
        """

    @abc.abstractmethod
    def air(self, state: Values, volume: Value, ambient: Ambient) -> Air:
        """Air state of a chamber with a volume [m3]."""

    @abc.abstractmethod
    def state_at(self, pressure: Value, volume: Value, ambient: Ambient) -> dict[str, Value]:
        """State of a chamber with a volume [m3] at rest at an absolute pressure [Pa] and ambient
        temperature.
        """

    @abc.abstractmethod
    def rates(
        self, state: Values, air: Air, flow: Flow, volume_rate: Value, ambient: Ambient
    ) -> dict[str, Value]:
        """Time derivatives of the states for an inflow and a rate of change of the volume
        [m3/s].
        """

    @abc.abstractmethod
    def available_energy(self, state: Values, volume: Value, ambient: Ambient) -> Value:
        """Available energy [J]; its derivative with respect to volume along the process is minus
        the pressure.
        """

    @abc.abstractmethod
    def energy_flow(self, state: Values, flow: Flow, volume: Value, ambient: Ambient) -> Value:
        """Power [W] that enters with the flow."""

    @abc.abstractmethod
    def sound_speed(self, air: Air) -> Value:
        """Speed of sound [m/s]: sqrt(dp/drho) along the process."""

    def heat_flow(self, state: Values, air: Air, ambient: Ambient) -> Value:
        """Heat flow [W] from the wall to the air; 0 for a gas model without heat transfer."""
        return 0.0


class BarotropicGas(Gas):
    """Barotropic gas: the pressure is a function of air mass and volume along one process
    (interface).
    """

    @abc.abstractmethod
    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Absolute pressure [Pa] of an air mass [kg] in a volume [m3]."""

    @abc.abstractmethod
    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        """Air mass [kg] at an absolute pressure [Pa] in a volume [m3]."""

    @abc.abstractmethod
    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        """Available energy [J]; its derivative with respect to volume is minus the absolute
        pressure.
        """

    def temperature(
        self, pressure: Value, air_mass: Value, volume: Value, ambient: Ambient
    ) -> Value:
        """Temperature [K] of an air mass [kg] at an absolute pressure [Pa] in a volume [m3];
        ambient by default.
        """
        return ambient.temperature

    def states(self, volume: Value, ambient: Ambient) -> tuple[StateVariable, ...]:
        nominal = self.air_mass(ambient.pressure, volume, ambient)
        return (StateVariable("air_mass", "kg", nominal, "air mass"),)

    def air(self, state: Values, volume: Value, ambient: Ambient) -> Air:
        pressure = self.pressure(state["air_mass"], volume, ambient)
        return Air(pressure, self.temperature(pressure, state["air_mass"], volume, ambient))

    def state_at(self, pressure: Value, volume: Value, ambient: Ambient) -> dict[str, Value]:
        return {"air_mass": self.air_mass(pressure, volume, ambient)}

    def rates(
        self, state: Values, air: Air, flow: Flow, volume_rate: Value, ambient: Ambient
    ) -> dict[str, Value]:
        return {"air_mass": flow.mass}

    def available_energy(self, state: Values, volume: Value, ambient: Ambient) -> Value:
        return self.energy(state["air_mass"], volume, ambient)

    def energy_flow(self, state: Values, flow: Flow, volume: Value, ambient: Ambient) -> Value:
        per_mass = autodiff.jvp(
            lambda x: [self.energy(x[0], volume, ambient)], [state["air_mass"]], [1.0]
        )
        return per_mass[0] * flow.mass


@model
class Isothermal(BarotropicGas):
    """Isothermal gas: p V = m R T at ambient temperature, as in Hošovský et al."""

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return air_mass * (GAS_CONSTANT * ambient.temperature) / volume

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        return pressure * volume / (GAS_CONSTANT * ambient.temperature)

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        ratio = self.pressure(air_mass, volume, ambient) / ambient.pressure
        return air_mass * GAS_CONSTANT * ambient.temperature * (ops.log(ratio) - 1.0)

    def sound_speed(self, air: Air) -> Value:
        return ops.sqrt(GAS_CONSTANT * air.temperature)


@model
class Polytropic(BarotropicGas):
    """Polytropic gas: p / rho^n is constant and equal to that of the ambient air.

        p = p_amb (m R T_amb / (p_amb V))^n,   so that   p' = n (R T m' - p V') / V   with T = p V /
                                               (m R)

    n -> 1 is isothermal, n = 1.4 adiabatic. The process passes through ambient pressure and
    temperature; air that has cooled at a higher pressure is not described.
    """

    exponent: float = parameter("1", "n", "polytropic exponent", bounds=(1.001, 1.667), default=1.2)

    def pressure(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        density_ratio = air_mass * (GAS_CONSTANT * ambient.temperature / ambient.pressure) / volume
        return ambient.pressure * density_ratio**self.exponent

    def air_mass(self, pressure: Value, volume: Value, ambient: Ambient) -> Value:
        density = ambient.pressure / (GAS_CONSTANT * ambient.temperature)
        return density * volume * (pressure / ambient.pressure) ** (1.0 / self.exponent)

    def temperature(
        self, pressure: Value, air_mass: Value, volume: Value, ambient: Ambient
    ) -> Value:
        return pressure * volume / (air_mass * GAS_CONSTANT)

    def energy(self, air_mass: Value, volume: Value, ambient: Ambient) -> Value:
        return self.pressure(air_mass, volume, ambient) * volume / (self.exponent - 1.0)

    def sound_speed(self, air: Air) -> Value:
        return ops.sqrt(self.exponent * GAS_CONSTANT * air.temperature)


class FirstLawGas(Gas):
    """Energy balance (first law) of dry ideal air in a chamber whose wall is at ambient temperature
    (interface).

        m' = sum m'_i,   U' = sum c_p T_i m'_i - p V' + Q',   T = U/(m c_v),   p = (gamma - 1) U/V

    m air mass, U internal energy, T_i upstream temperature of each flow, Q' heat flow from the
    wall; gamma = 1.4.
    """

    def states(self, volume: Value, ambient: Ambient) -> tuple[StateVariable, ...]:
        rest = self.state_at(ambient.pressure, volume, ambient)
        return (
            StateVariable("air_mass", "kg", rest["air_mass"], "air mass"),
            StateVariable(
                "internal_energy", "J", rest["internal_energy"], "internal energy of the air"
            ),
        )

    def air(self, state: Values, volume: Value, ambient: Ambient) -> Air:
        energy = state["internal_energy"]
        temperature = energy / (state["air_mass"] * SPECIFIC_HEAT_CONSTANT_VOLUME)
        return Air((HEAT_CAPACITY_RATIO - 1.0) * energy / volume, temperature)

    def state_at(self, pressure: Value, volume: Value, ambient: Ambient) -> dict[str, Value]:
        return {
            "air_mass": pressure * volume / (GAS_CONSTANT * ambient.temperature),
            "internal_energy": pressure * volume / (HEAT_CAPACITY_RATIO - 1.0),
        }

    def rates(
        self, state: Values, air: Air, flow: Flow, volume_rate: Value, ambient: Ambient
    ) -> dict[str, Value]:
        energy = flow.enthalpy - air.pressure * volume_rate + self.heat_flow(state, air, ambient)
        return {"air_mass": flow.mass, "internal_energy": energy}

    def available_energy(self, state: Values, volume: Value, ambient: Ambient) -> Value:
        return state["internal_energy"]

    def energy_flow(self, state: Values, flow: Flow, volume: Value, ambient: Ambient) -> Value:
        return flow.enthalpy

    def sound_speed(self, air: Air) -> Value:
        """Adiabatic speed of sound [m/s]; a heat transfer that is fast against the period reduces
        it to isothermal.
        """
        return ops.sqrt(HEAT_CAPACITY_RATIO * GAS_CONSTANT * air.temperature)


@model
class EnergyBalance(FirstLawGas):
    """Energy balance with Q' = hA (T_amb - T), the heat transfer coefficient times the area of the
    wall of a chamber.

    hA = 0 is adiabatic, a large hA isothermal. The equations are those of FirstLawGas.
    """

    heat_transfer: float = parameter(
        "W/K", "hA", "heat transfer coefficient times wall area", bounds=(0.0, 1e5)
    )

    def heat_flow(self, state: Values, air: Air, ambient: Ambient) -> Value:
        return self.heat_transfer * (ambient.temperature - air.temperature)
