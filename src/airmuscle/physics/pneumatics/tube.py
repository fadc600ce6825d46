"""Tubes between valve and muscle: interface, lumped tube in one or more segments, circuit with tubes."""

import abc
from collections.abc import Mapping
from typing import Any, ClassVar

from ...core import Reference, Value, Values, model, ops, parameter, published, unflatten, within
from ...core.system import StateVariable, add_prefix, select_prefix, with_prefix
from .circuit import Circuit, CircuitFlows, CircuitWrapper, port_prefix
from .gas import Air, Ambient, Flow, Gas, Isothermal, gauge_pressure
from .valve import Orifice, Valve, orifice_flow

MAX_SEGMENTS = 200
"""Maximum number of segments of a tube (chosen)."""


class TubeModel(abc.ABC):
    """Tube between valve and muscle (interface). States are mappings from the names in `states` to values."""

    references: ClassVar[tuple[Reference, ...]] = ()
    segment_count: int

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the state names of each segment, from valve to muscle."""
        if self.segment_count == 1:
            return ("tube.",)
        return tuple(f"tube{i}." for i in range(1, self.segment_count + 1))

    @abc.abstractmethod
    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables of all segments."""

    @abc.abstractmethod
    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        """Steady state without flow at the pressure of the air in the muscle."""

    @abc.abstractmethod
    def air_states(self, state: Values, ambient: Ambient) -> tuple[Air, ...]:
        """Air state of each segment, from valve to muscle."""

    @abc.abstractmethod
    def rates(
        self, state: Values, air_states: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        """Time derivatives of the states for a flow from the valve, and the flow into the muscle."""

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Warnings by segment prefix where a run left the validity range; `columns` are arrays (N,) by name."""
        return {}


ECKERSTEN = published("eckersten-1975")
_TEMPLATE_VALVE = Valve(1e-8, 0.3)


@model
class TubeOrifice(Orifice):
    """Flow through a smooth tube including end losses, as an orifice after ISO 6358.

        C = 0.029 D^2/sqrt(L/D^1.25 + 510),   b = 474 C/D^2

    C sonic conductance [m3/(s Pa)], b critical pressure ratio, D inner diameter [m], L length [m]. The formula is
    empirical; its constants hold for these units. Reference: Eckersten (1975), after Beater (2007).
    """

    references: ClassVar[tuple[Reference, ...]] = (ECKERSTEN,)

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

    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        valve = unflatten(_TEMPLATE_VALVE, (self.conductance, self.critical_ratio, _TEMPLATE_VALVE.laminar_ratio))
        return valve.mass_flow(upstream, downstream, opening, temperature)


@model
class Tube(TubeModel):
    """Lumped tube: a volume with an orifice towards the muscle, divided into n segments in series.

    `orifice` and `volume` describe the whole tube. Each of n segments has 1/n of the volume and sqrt(n) times the
    conductance. This is exact for the flow law of a tube with friction, q^2 = C^2 (p_1^2 - p_2^2), which is a critical
    ratio of 0, and for any critical ratio near equal pressures. The model has no inertia: a pressure step has an
    immediate, though small, effect at the other end; `DistributedTube` describes delay and resonance. The valve feeds
    the volume of the first segment.
    """

    orifice: Orifice
    volume: float = parameter("m3", "V_t", "volume of the tube", bounds=(1e-9, 1e-2))
    segment_count: int = within(1, MAX_SEGMENTS, default=1)
    gas: Gas = Isothermal()

    @classmethod
    def from_dimensions(cls, length: float, diameter: float, segment_count: int = 1, gas: Gas = Isothermal()) -> "Tube":
        """Tube of a length and an inner diameter [m], with the flow of a `TubeOrifice`."""
        return cls(TubeOrifice(length, diameter), ops.pi / 4.0 * diameter**2 * length, segment_count, gas)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        segment = self.gas.states(self.volume / self.segment_count, ambient)
        return tuple(state for prefix in self.prefixes for state in add_prefix(prefix, segment))

    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        segment = self.gas.state_at(air.pressure, self.volume / self.segment_count, ambient)
        return {name: value for prefix in self.prefixes for name, value in with_prefix(prefix, segment).items()}

    def air_states(self, state: Values, ambient: Ambient) -> tuple[Air, ...]:
        segments = (select_prefix(prefix, state) for prefix in self.prefixes)
        return tuple(self.gas.air(segment, self.volume / self.segment_count, ambient) for segment in segments)

    def rates(
        self, state: Values, air_states: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        rates: dict[str, Value] = {}
        for prefix, air, downstream in zip(self.prefixes, air_states, (*air_states[1:], muscle), strict=True):
            outflow = orifice_flow(self.orifice, air, downstream, self.segment_count**0.5)
            segment = self.gas.rates(select_prefix(prefix, state), air, flow - outflow, 0.0, ambient)
            rates |= with_prefix(prefix, segment)
            flow = outflow
        return rates, flow


@model
class WithTubes(CircuitWrapper):
    """Circuit with a tube between its valves and each of its muscles.

    The output `tube.pressure` is the pressure in the tube; with several segments, `tube1.pressure`, ... are numbered
    from the valve. If one circuit feeds several muscles, a plant prefixes each tube with the name of its muscle, as in
    `left.tube.pressure`.
    """

    circuit: Circuit
    tube: TubeModel

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each muscle's tube."""
        return ("",) if self.port_count == 1 else tuple(port_prefix(i) for i in range(1, self.port_count + 1))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        tube = self.tube.states(ambient)
        return (*self.circuit.own_states(ambient), *(s for prefix in self.prefixes for s in add_prefix(prefix, tube)))

    def own_steady_state(self, air_states: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        state = self.circuit.own_steady_state(air_states, ambient)
        for prefix, air in zip(self.prefixes, air_states, strict=True):
            state |= with_prefix(prefix, self.tube.steady_state(air, ambient))
        return state

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        warnings = self.circuit.validity_warnings(columns, ambient)
        for prefix in self.prefixes:
            warnings |= with_prefix(prefix, self.tube.validity_warnings(select_prefix(prefix, columns), ambient))
        return warnings

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        tubes = [select_prefix(prefix, state) for prefix in self.prefixes]
        in_tubes = [self.tube.air_states(tube, ambient) for tube in tubes]
        inner = self.circuit.supplied_flow(inlet, tuple(segments[0] for segments in in_tubes), state, inputs, ambient)
        rates, outputs, flows = dict(inner.rates), dict(inner.outputs), []
        for prefix, tube, segments, inflow, air in zip(
            self.prefixes, tubes, in_tubes, inner.flows, air_states, strict=True
        ):
            tube_rates, outflow = self.tube.rates(tube, segments, inflow, air, ambient)
            rates |= with_prefix(prefix, tube_rates)
            for segment, in_segment in zip(self.tube.prefixes, segments, strict=True):
                outputs[f"{prefix}{segment}pressure"] = gauge_pressure(in_segment.pressure, ambient)
            flows.append(outflow)
        return CircuitFlows(tuple(flows), inner.drawn, inner.exhausted, rates, outputs)
