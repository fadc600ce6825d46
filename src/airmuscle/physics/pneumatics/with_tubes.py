"""WithTubes: a circuit with a tube between its valves and each muscle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...core.declaration import model
from ...core.ops import Value
from ...core.variables import StateVariable, add_prefix, select_prefix, with_prefix
from .circuit import Circuit, CircuitFlows
from .gas import Air, Ambient, gauge_pressure
from .ports import port_prefix
from .tube_model import TubeModel
from .wrapper import CircuitWrapper


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
        self, inlet: Air, air_states: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
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
