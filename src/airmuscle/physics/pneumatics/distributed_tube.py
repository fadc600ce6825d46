"""Distributed tube between valve and muscle: lumped segments with the inertia of the air."""

from collections.abc import Mapping
from typing import Any, ClassVar

from ...core import Reference, Value, Values, model, ops, parameter, published, within
from ...core.system import StateVariable, add_prefix, select_prefix, with_prefix
from .gas import GAS_CONSTANT, SPECIFIC_HEAT_CONSTANT_PRESSURE, Air, Ambient, Flow, Gas, Isothermal
from .tube import MAX_SEGMENTS, TubeModel

BLASIUS1913 = published("blasius-1913")
TRANSITION_REYNOLDS_NUMBER = (64.0 / 0.3164) ** (4.0 / 3.0)
"""Reynolds number at which the friction of Hagen-Poiseuille and that of Blasius are equal, 1187."""
MAX_MACH_NUMBER = 1.0 / 3.0
"""Mach number up to which the convected momentum may be neglected (chosen)."""


@model
class DistributedTube(TubeModel):
    """Distributed tube: mass and momentum balance of n segments, with air mass and mass flow as states.

        m_i' = q_(i-1) - q_i,   q_i' = (A/dx) (p_i - p_(i+1)) - f q_i,   f = 32 mu/(rho D^2) max(1, Re/1187)^(3/4)

    q_0 flow from the valve, q_n flow into the muscle, p_(n+1) pressure in the muscle; dx = L/n, A = pi D^2/4,
    Re = |q| D/(A mu), rho mean density of both sides. The friction f is that of Hagen-Poiseuille and, for Re > 1187,
    that of Blasius for smooth tubes (valid up to about Re = 1e5). The last segment also has the loss of both ends,
    zeta dynamic heads, a force zeta |q| q/(2 rho A): 0.5 for a sharp-edged inlet and 1 for the outlet. A pressure step
    arrives after L/c, with c the speed of sound of the gas (`Gas.sound_speed`), and is attenuated by exp(-f L/(2 c)).
    A steady isothermal flow satisfies p_1^2 - p_2^2 = R T (2 f rho L q/A + zeta q^2/A^2) exactly for any number of
    segments; a wave front is spread over about n^(1/3) segments. Neglected: the convected momentum (valid up to a Mach
    number of about 1/3; the tube has no choking, only the valve has), frequency-dependent friction, and the kinetic
    energy in the energy balance of the gas.
    """

    references: ClassVar[tuple[Reference, ...]] = (BLASIUS1913,)

    length: float = parameter("m", "L", "length of the tube", bounds=(1e-3, 200.0))
    diameter: float = parameter("m", "D", "inner diameter of the tube", bounds=(5e-4, 0.1))
    segment_count: int = within(1, MAX_SEGMENTS, default=20)
    gas: Gas = Isothermal()
    viscosity: float = parameter(
        "Pa s", "mu", "dynamic viscosity of the air", bounds=(1e-6, 1e-4), fitted=False, default=1.82e-5
    )
    end_loss: float = parameter(
        "1", "zeta", "loss coefficient of both ends, in dynamic heads", bounds=(0.0, 10.0), default=1.5
    )

    @property
    def area(self) -> Value:
        """Cross-sectional area A [m2]."""
        return ops.pi / 4.0 * self.diameter**2

    @property
    def segment_volume(self) -> Value:
        """Volume of one segment [m3]."""
        return self.area * self.length / self.segment_count

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        nominal_flow = 0.1 * self.area * ambient.pressure / self.gas.sound_speed(_resting_air(ambient))
        segment = (
            *self.gas.states(self.segment_volume, ambient),
            StateVariable("flow", "kg/s", nominal_flow, "mass flow to the next segment"),
        )
        return tuple(state for prefix in self.prefixes for state in add_prefix(prefix, segment))

    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        segment = {**self.gas.state_at(air.pressure, self.segment_volume, ambient), "flow": 0.0}
        return {name: value for prefix in self.prefixes for name, value in with_prefix(prefix, segment).items()}

    def air_states(self, state: Values, ambient: Ambient) -> tuple[Air, ...]:
        segments = (select_prefix(prefix, state) for prefix in self.prefixes)
        return tuple(self.gas.air(segment, self.segment_volume, ambient) for segment in segments)

    def rates(
        self, state: Values, air_states: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        rates: dict[str, Value] = {}
        for prefix, air, downstream in zip(self.prefixes, air_states, (*air_states[1:], muscle), strict=True):
            mass_flow = state[f"{prefix}flow"]
            outflow = _convected_flow(mass_flow, air, downstream)
            segment = self.gas.rates(select_prefix(prefix, state), air, flow - outflow, 0.0, ambient)
            rates |= with_prefix(prefix, segment)
            density = (_density(air) + _density(downstream)) / 2.0
            force = self.area * (air.pressure - downstream.pressure)
            if downstream is muscle:
                force = force - self.end_loss * ops.absolute_value(mass_flow) * mass_flow / (2.0 * density * self.area)
            friction = self.friction_coefficient(mass_flow, density) * mass_flow
            rates[f"{prefix}flow"] = force * self.segment_count / self.length - friction
            flow = outflow
        return rates, flow

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Warnings by segment prefix where the Mach number, at ambient temperature, exceeded 1/3."""
        sound_speed, warnings = self.gas.sound_speed(_resting_air(ambient)), {}
        for prefix in self.prefixes:
            if not {f"{prefix}flow", f"{prefix}pressure"} <= columns.keys():
                continue
            density = (columns[f"{prefix}pressure"] + ambient.pressure) / (GAS_CONSTANT * ambient.temperature)
            mach_number = (abs(columns[f"{prefix}flow"]) / (density * self.area * sound_speed)).max()
            if mach_number > MAX_MACH_NUMBER:
                warnings[prefix] = (
                    f"the Mach number reached {mach_number:.2g}; DistributedTube does not describe choking and "
                    "overestimates the flow at Mach numbers above 1/3"
                )
        return warnings

    def friction_coefficient(self, mass_flow: Value, density: Value) -> Value:
        """Friction coefficient f [1/s] for a mass flow [kg/s] of air of a density [kg/m3]."""
        reynolds = ops.absolute_value(mass_flow) * self.diameter / (self.area * self.viscosity)
        laminar = 32.0 * self.viscosity / (density * self.diameter**2)
        return laminar * ops.maximum(reynolds / TRANSITION_REYNOLDS_NUMBER, 1.0) ** 0.75


def _resting_air(ambient: Ambient) -> Air:
    return Air(ambient.pressure, ambient.temperature)


def _density(air: Air) -> Value:
    return air.pressure / (GAS_CONSTANT * air.temperature)


def _convected_flow(mass_flow: Value, air: Air, downstream: Air) -> Flow:
    """A mass flow and its enthalpy flow, with the temperature of the upstream side."""
    temperature = air.temperature
    if downstream.temperature is not air.temperature:
        temperature = ops.where(mass_flow >= 0, air.temperature, downstream.temperature)
    return Flow(mass_flow, SPECIFIC_HEAT_CONSTANT_PRESSURE * temperature * mass_flow)
