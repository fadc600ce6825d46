"""Tubes between valve and muscle: interface, lumped tube, tube with the inertia of the air, circuit
with tubes.
"""

import abc
from collections.abc import Mapping
from typing import Any, ClassVar

from ...core import Reference, Value, Values, model, ops, parameter, published, unflatten, within
from ...core.system import StateVariable, add_prefix, select_prefix, with_prefix
from .circuit import Circuit, CircuitFlows, CircuitWrapper, ambient_air, port_prefix
from .gas import (
    GAS_CONSTANT,
    Air,
    Airs,
    Ambient,
    Flow,
    Gas,
    Isothermal,
    gauge_pressure,
    upstream_temperature,
)
from .valve import Orifice, Valve, orifice_flow

MAX_SEGMENTS = 200
"""Maximum number of segments of a tube (chosen)."""


class TubeModel(abc.ABC):
    """Tube between valve and muscle (interface). States are mappings from the names in `states` to
    values.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    segment_count: int
    gas: Gas

    @property
    @abc.abstractmethod
    def segment_volume(self) -> Value:
        """Volume of one segment [m3]."""

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the state names of each segment, from valve to muscle."""
        if self.segment_count == 1:
            return ("tube.",)
        return tuple(f"tube{i}." for i in range(1, self.segment_count + 1))

    def segment_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables of one segment: those of its gas."""
        return self.gas.states(self.segment_volume, ambient)

    def resting_segment(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        """Steady state of one segment without flow at the pressure of the air in the muscle."""
        return self.gas.state_at(air.pressure, self.segment_volume, ambient)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables of all segments."""
        segment = self.segment_states(ambient)
        return tuple(state for prefix in self.prefixes for state in add_prefix(prefix, segment))

    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        """Steady state without flow at the pressure of the air in the muscle."""
        segment = self.resting_segment(air, ambient)
        return {
            f"{prefix}{name}": value for prefix in self.prefixes for name, value in segment.items()
        }

    def air_states(self, state: Values, ambient: Ambient) -> Airs:
        """Air state of each segment, from valve to muscle."""
        segments = (select_prefix(prefix, state) for prefix in self.prefixes)
        return tuple(self.gas.air(segment, self.segment_volume, ambient) for segment in segments)

    @abc.abstractmethod
    def rates(
        self, state: Values, air_states: Airs, flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[Values, Flow]:
        """Time derivatives of the states for a flow from the valve, and the flow into the
        muscle.
        """

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Warnings by segment prefix where a run left the validity range; `columns` are arrays (N,)
        by name.
        """
        return {}


_TEMPLATE_VALVE = Valve(1e-8, 0.3)


@model
class TubeOrifice(Orifice):
    """Flow through a smooth tube including end losses, as an orifice after ISO 6358.

        C = 0.029 D^2/sqrt(L/D^1.25 + 510),   b = 474 C/D^2

    C sonic conductance [m3/(s Pa)], b critical pressure ratio, D inner diameter [m], L length [m].
    The formula is empirical; its constants hold for these units. Reference: Eckersten (1975), after
    Beater (2007).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("eckersten-1975"),)

    length: float = parameter("m", "L", "length of the tube", bounds=(1e-3, 200.0))
    diameter: float = parameter("m", "D", "inner diameter of the tube", bounds=(5e-4, 0.1))

    @property
    def conductance(self) -> Value:
        """Sonic conductance C [m3/(s Pa)]."""
        return 0.029 * self.diameter**2 / ops.sqrt(self.length / self.diameter**1.25 + 510.0)

    @property
    def critical_ratio(self) -> Value:
        """Critical pressure ratio b."""
        return 474.0 * self.conductance / self.diameter**2

    def mass_flow(
        self, upstream: Value, downstream: Value, opening: Value, temperature: Value
    ) -> Value:
        valve = unflatten(
            _TEMPLATE_VALVE, (self.conductance, self.critical_ratio, _TEMPLATE_VALVE.laminar_ratio)
        )
        return valve.mass_flow(upstream, downstream, opening, temperature)


@model
class Tube(TubeModel):
    """Lumped tube: a volume with an orifice towards the muscle, divided into n segments in series.

    `orifice` and `volume` describe the whole tube. Each of n segments has 1/n of the volume and
    sqrt(n) times the conductance. This is exact for the flow law of a tube with friction, q^2 = C^2
    (p_1^2 - p_2^2), which is a critical ratio of 0, and for any critical ratio near equal
    pressures. The model has no inertia: a pressure step has an immediate, though small, effect at
    the other end; `DistributedTube` describes delay and resonance. The valve feeds the volume of
    the first segment.
    """

    orifice: Orifice
    volume: float = parameter("m3", "V_t", "volume of the tube", bounds=(1e-9, 1e-2))
    segment_count: int = within(1, MAX_SEGMENTS, default=1)
    gas: Gas = Isothermal()

    @classmethod
    def from_dimensions(
        cls, length: float, diameter: float, segment_count: int = 1, gas: Gas = Isothermal()
    ) -> "Tube":
        """Tube of a length and an inner diameter [m], with the flow of a `TubeOrifice`."""
        return cls(
            TubeOrifice(length, diameter), ops.pi / 4.0 * diameter**2 * length, segment_count, gas
        )

    @property
    def segment_volume(self) -> Value:
        return self.volume / self.segment_count

    def rates(
        self, state: Values, air_states: Airs, flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[Values, Flow]:
        rates: dict[str, Value] = {}
        for prefix, air, downstream in zip(
            self.prefixes, air_states, (*air_states[1:], muscle), strict=True
        ):
            outflow = orifice_flow(self.orifice, air, downstream, self.segment_count**0.5)
            segment = self.gas.rates(
                select_prefix(prefix, state), air, flow - outflow, 0.0, ambient
            )
            rates |= with_prefix(prefix, segment)
            flow = outflow
        return rates, flow


TRANSITION_REYNOLDS_NUMBER = (64.0 / 0.3164) ** (4.0 / 3.0)
"""Reynolds number at which the friction of Hagen-Poiseuille and that of Blasius are equal, 1187."""
MAX_MACH_NUMBER = 1.0 / 3.0
"""Mach number up to which the convected momentum may be neglected (chosen)."""


@model
class DistributedTube(TubeModel):
    """Distributed tube: mass and momentum balance of n segments, with air mass and mass flow as
    states.

        m_i' = q_(i-1) - q_i,   q_i' = (A/dx) (p_i - p_(i+1)) - f q_i,   f = 32 mu/(rho D^2) max(1,
                                Re/1187)^(3/4)

    q_0 flow from the valve, q_n flow into the muscle, p_(n+1) pressure in the muscle; dx = L/n, A =
    pi D^2/4, Re = |q| D/(A mu), rho mean density of both sides. The friction f is that of
    Hagen-Poiseuille and, for Re > 1187, that of Blasius for smooth tubes (valid up to about Re =
    1e5). The last segment also has the loss of both ends, zeta dynamic heads, a force zeta |q| q/(2
    rho A): 0.5 for a sharp-edged inlet and 1 for the outlet. A pressure step arrives after L/c,
    with c the speed of sound of the gas (`Gas.sound_speed`), and is attenuated by exp(-f L/(2 c)).
    A steady isothermal flow satisfies p_1^2 - p_2^2 = R T (2 f rho L q/A + zeta q^2/A^2) exactly
    for any number of segments; a wave front is spread over about n^(1/3) segments. Neglected: the
    convected momentum (valid up to a Mach number of about 1/3; the tube has no choking, only the
    valve has), frequency-dependent friction, and the kinetic energy in the energy balance of the
    gas.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("blasius-1913"),)

    length: float = parameter("m", "L", "length of the tube", bounds=(1e-3, 200.0))
    diameter: float = parameter("m", "D", "inner diameter of the tube", bounds=(5e-4, 0.1))
    segment_count: int = within(1, MAX_SEGMENTS, default=20)
    gas: Gas = Isothermal()
    viscosity: float = parameter(
        "Pa s",
        "mu",
        "dynamic viscosity of the air",
        bounds=(1e-6, 1e-4),
        fitted=False,
        default=1.82e-5,
    )
    end_loss: float = parameter(
        "1",
        "zeta",
        "loss coefficient of both ends, in dynamic heads",
        bounds=(0.0, 10.0),
        default=1.5,
    )

    @property
    def area(self) -> Value:
        """Cross-sectional area A [m2]."""
        return ops.pi / 4.0 * self.diameter**2

    @property
    def segment_volume(self) -> Value:
        return self.area * self.length / self.segment_count

    def segment_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        nominal_flow = (
            0.1 * self.area * ambient.pressure / self.gas.sound_speed(ambient_air(ambient))
        )
        flow = StateVariable("flow", "kg/s", nominal_flow, "mass flow to the next segment")
        return (*super().segment_states(ambient), flow)

    def resting_segment(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        return {**super().resting_segment(air, ambient), "flow": 0.0}

    def rates(
        self, state: Values, air_states: Airs, flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[Values, Flow]:
        rates: dict[str, Value] = {}
        for prefix, air, downstream in zip(
            self.prefixes, air_states, (*air_states[1:], muscle), strict=True
        ):
            mass_flow = state[f"{prefix}flow"]
            outflow = Flow.at(upstream_temperature(air, downstream, mass_flow >= 0), mass_flow)
            segment = self.gas.rates(
                select_prefix(prefix, state), air, flow - outflow, 0.0, ambient
            )
            rates |= with_prefix(prefix, segment)
            density = (_density(air) + _density(downstream)) / 2.0
            force = self.area * (air.pressure - downstream.pressure)
            if downstream is muscle:
                force = force - self.end_loss * ops.absolute_value(mass_flow) * mass_flow / (
                    2.0 * density * self.area
                )
            friction = self.friction_coefficient(mass_flow, density) * mass_flow
            rates[f"{prefix}flow"] = force * self.segment_count / self.length - friction
            flow = outflow
        return rates, flow

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Warnings by segment prefix where the Mach number, at ambient temperature, exceeded
        1/3.
        """
        sound_speed = self.gas.sound_speed(ambient_air(ambient))
        warnings = {}
        for prefix in self.prefixes:
            if not {f"{prefix}flow", f"{prefix}pressure"} <= columns.keys():
                continue
            density = (columns[f"{prefix}pressure"] + ambient.pressure) / (
                GAS_CONSTANT * ambient.temperature
            )
            mach_number = (
                abs(columns[f"{prefix}flow"]) / (density * self.area * sound_speed)
            ).max()
            if mach_number > MAX_MACH_NUMBER:
                warnings[prefix] = (
                    f"the Mach number reached {mach_number:.2g}; DistributedTube does not describe"
                    " choking and overestimates the flow at Mach numbers above 1/3"
                )
        return warnings

    def friction_coefficient(self, mass_flow: Value, density: Value) -> Value:
        """Friction coefficient f [1/s] for a mass flow [kg/s] of air of a density [kg/m3]."""
        reynolds = ops.absolute_value(mass_flow) * self.diameter / (self.area * self.viscosity)
        laminar = 32.0 * self.viscosity / (density * self.diameter**2)
        return laminar * ops.maximum(reynolds / TRANSITION_REYNOLDS_NUMBER, 1.0) ** 0.75


def _density(air: Air) -> Value:
    return air.pressure / (GAS_CONSTANT * air.temperature)


@model
class WithTubes(CircuitWrapper):
    """Circuit with a tube between its valves and each of its muscles.

    The output `tube.pressure` is the pressure in the tube; with several segments, `tube1.pressure`,
    ... are numbered from the valve. If one circuit feeds several muscles, a plant prefixes each
    tube with the name of its muscle, as in `left.tube.pressure`.
    """

    circuit: Circuit
    tube: TubeModel

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each muscle's tube."""
        return (
            ("",)
            if self.port_count == 1
            else tuple(port_prefix(i) for i in range(1, self.port_count + 1))
        )

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        tube = self.tube.states(ambient)
        return (
            *self.circuit.own_states(ambient),
            *(s for prefix in self.prefixes for s in add_prefix(prefix, tube)),
        )

    def own_steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        state = self.circuit.own_steady_state(muscles, ambient)
        for prefix, air in zip(self.prefixes, muscles, strict=True):
            state |= with_prefix(prefix, self.tube.steady_state(air, ambient))
        return state

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        warnings = self.circuit.validity_warnings(columns, ambient)
        for prefix in self.prefixes:
            warnings |= with_prefix(
                prefix, self.tube.validity_warnings(select_prefix(prefix, columns), ambient)
            )
        return warnings

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        tubes = [select_prefix(prefix, state) for prefix in self.prefixes]
        in_tubes = [self.tube.air_states(tube, ambient) for tube in tubes]
        inner = self.circuit.supplied_flow(
            inlet, tuple(segments[0] for segments in in_tubes), state, inputs, ambient
        )
        rates = dict(inner.rates)
        outputs = dict(inner.outputs)
        flows = []
        parts = zip(self.prefixes, tubes, in_tubes, inner.flows, muscles, strict=True)
        for prefix, tube, segments, inflow, air in parts:
            tube_rates, outflow = self.tube.rates(tube, segments, inflow, air, ambient)
            rates |= with_prefix(prefix, tube_rates)
            for segment, in_segment in zip(self.tube.prefixes, segments, strict=True):
                outputs[f"{prefix}{segment}pressure"] = gauge_pressure(in_segment.pressure, ambient)
            flows.append(outflow)
        return CircuitFlows(tuple(flows), inner.drawn, inner.exhausted, rates, outputs)
