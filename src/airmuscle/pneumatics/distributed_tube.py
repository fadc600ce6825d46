"""The tube between a valve and a muscle with the inertia of its air: pressure travels at the speed of sound."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import StateVariable, add_prefix, select_prefix, with_prefix
from .gas import GAS_CONSTANT, SPECIFIC_HEAT_CONSTANT_PRESSURE, Air, Ambient, Flow, Gas, Isothermal
from .tube import check_segment_count
from .tube_model import TubeModel

BLASIUS1913 = Reference(
    "blasius-1913",
    "Blasius, H.",
    "Das Aehnlichkeitsgesetz bei Reibungsvorgaengen in Fluessigkeiten",
    "Mitteilungen ueber Forschungsarbeiten auf dem Gebiete des Ingenieurwesens 131",
    1913,
    note="friction factor 0.3164 Re^(-1/4) of turbulent flow in a smooth tube",
)
TRANSITION_REYNOLDS_NUMBER = (64.0 / 0.3164) ** (4.0 / 3.0)
"""Reynolds number at which Hagen-Poiseuille's and Blasius' friction are equal, 1187."""


MAX_MACH_NUMBER = 1.0 / 3.0
"""Share of the speed of sound up to which the momentum that the flow carries along may be left out (chosen)."""


@model
class DistributedTube(TubeModel):
    """A tube of n pieces with mass and flow in each, by balance of mass and of momentum:

        m_i' = q_(i-1) - q_i,   q_i' = (A/dx) (p_i - p_(i+1)) - f q_i,   f = 32 mu/(rho D^2) max(1, Re/1187)^(3/4)

    q_0 the valve's flow, q_n that into the muscle, p_(n+1) its pressure; dx = L/n, A = pi D^2/4, Re = |q| D/(A mu),
    rho the mean density of both sides. f is Hagen-Poiseuille's friction, and from Re = 1187 on, where they meet, that
    of Blasius for smooth tubes (up to about 1e5). The last piece also loses zeta dynamic heads, zeta |q| q/(2 rho A)
    of force, for both ends: 0.5 where air enters a sharp edge and 1 where it leaves. A step of pressure arrives after
    L/c, c the speed of sound of the gas (`Gas.sound_speed`), and fades as exp(-f L/(2 c)). A steady isothermal flow
    obeys p_1^2 - p_2^2 = R T (2 f rho L q/A + zeta q^2/A^2) exactly, however few the pieces; a front is smeared over
    about n^(1/3) of them. Left out: the momentum that the flow carries along (right below a third of the speed of
    sound; nothing chokes here, the valve does that), friction that depends on frequency, and the kinetic energy in the
    gas's balance.
    """

    references: ClassVar[tuple[Reference, ...]] = (BLASIUS1913,)

    length: float = parameter("m", "L", "length of the tube", bounds=(1e-3, 200.0))
    diameter: float = parameter("m", "D", "inner diameter of the tube", bounds=(5e-4, 0.1))
    segment_count: int = 20
    gas: Gas = Isothermal()
    viscosity: float = parameter(
        "Pa s", "mu", "dynamic viscosity of the air", bounds=(1e-6, 1e-4), fitted=False, default=1.82e-5
    )

    end_loss: float = parameter("1", "zeta", "loss at both ends, in dynamic heads", bounds=(0.0, 10.0), default=1.5)

    def check(self) -> None:
        check_segment_count("DistributedTube", self.segment_count)

    @property
    def area(self) -> Value:
        """A, cross section [m2]."""
        return ops.pi / 4.0 * self.diameter**2

    @property
    def segment_volume(self) -> Value:
        """Volume [m3] of one piece."""
        return self.area * self.length / self.segment_count

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        brisk = 0.1 * self.area * ambient.pressure / self.gas.sound_speed(_resting_air(ambient))
        of_piece = (
            *self.gas.states(self.segment_volume, ambient),
            StateVariable("flow", "kg/s", brisk, "mass flow to the next piece"),
        )
        return tuple(state for name in self.prefixes for state in add_prefix(name, of_piece))

    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        content = {**self.gas.state_at(air.pressure, self.segment_volume, ambient), "flow": 0.0}
        return {name: value for prefix in self.prefixes for name, value in with_prefix(prefix, content).items()}

    def air_states(self, state: Mapping[str, Value], ambient: Ambient) -> tuple[Air, ...]:
        held = (select_prefix(name, state) for name in self.prefixes)
        return tuple(self.gas.air(content, self.segment_volume, ambient) for content in held)

    def rates(
        self, state: Mapping[str, Value], airs: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        rates: dict[str, Value] = {}
        for name, air, after in zip(self.prefixes, airs, (*airs[1:], muscle), strict=True):
            mass = state[f"{name}flow"]
            onward = _convected_flow(mass, air, after)
            rates |= with_prefix(name, self.gas.rates(select_prefix(name, state), air, flow - onward, 0.0, ambient))
            density = (_density(air) + _density(after)) / 2.0
            force = self.area * (air.pressure - after.pressure)
            if after is muscle:
                force = force - self.end_loss * ops.absolute_value(mass) * mass / (2.0 * density * self.area)
            rates[f"{name}flow"] = (
                force * self.segment_count / self.length - self.friction_coefficient(mass, density) * mass
            )
            flow = onward
        return rates, flow

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Where its air ran faster than a third of the speed of sound, at the temperature of the surroundings."""
        still, found = _resting_air(ambient), {}
        for name in self.prefixes:
            if not {f"{name}flow", f"{name}pressure"} <= columns.keys():
                continue
            density = (columns[f"{name}pressure"] + ambient.pressure) / (GAS_CONSTANT * ambient.temperature)
            share = (abs(columns[f"{name}flow"]) / (density * self.area * self.gas.sound_speed(still))).max()
            if share > MAX_MACH_NUMBER:
                found[name] = (
                    f"air ran at up to {share:.2g} times the speed of sound; DistributedTube knows no choking and lets "
                    "through too much beyond a third of it"
                )
        return found

    def friction_coefficient(self, mass_flow: Value, density: Value) -> Value:
        """f [1/s], by which friction slows a mass flow [kg/s] of air of a density [kg/m3]."""
        reynolds = ops.absolute_value(mass_flow) * self.diameter / (self.area * self.viscosity)
        laminar = 32.0 * self.viscosity / (density * self.diameter**2)
        return laminar * ops.maximum(reynolds / TRANSITION_REYNOLDS_NUMBER, 1.0) ** 0.75


def _resting_air(ambient: Ambient) -> Air:
    return Air(ambient.pressure, ambient.temperature)


def _density(air: Air) -> Value:
    return air.pressure / (GAS_CONSTANT * air.temperature)


def _convected_flow(mass: Value, air: Air, after: Air) -> Flow:
    """A mass flow with the temperature of the piece that it comes from."""
    temperature = air.temperature
    if after.temperature is not air.temperature:
        temperature = ops.where(mass >= 0, air.temperature, after.temperature)
    return Flow(mass, SPECIFIC_HEAT_CONSTANT_PRESSURE * temperature * mass)
