"""A circuit whose valves feed its muscles through tubes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..core.declaration import model
from ..core.ops import Value
from ..core.variables import StateVariable, add_prefix, select_prefix, with_prefix
from .circuit import Circuit, CircuitFlows
from .gas import Air, Ambient, gauge_pressure
from .ports import port_prefix
from .tube_model import TubeModel
from .wrapper import CircuitWrapper


@model
class WithTubes(CircuitWrapper):
    """A tube between a circuit's valves and each of its muscles.

    `tube.pressure` is that in the tube; with several pieces `tube1.pressure`, ... from the valve on. Where one circuit
    feeds several muscles, a plant calls each tube by its muscle, `left.tube.pressure`.
    """

    circuit: Circuit
    tube: TubeModel

    @property
    def prefixes(self) -> tuple[str, ...]:
        """What the names of each muscle's tube begin with."""
        return ("",) if self.port_count == 1 else tuple(port_prefix(i) for i in range(1, self.port_count + 1))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        of_tube = self.tube.states(ambient)
        return (*self.circuit.own_states(ambient), *(s for name in self.prefixes for s in add_prefix(name, of_tube)))

    def own_steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        found = self.circuit.own_steady_state(airs, ambient)
        for name, air in zip(self.prefixes, airs, strict=True):
            found |= with_prefix(name, self.tube.steady_state(air, ambient))
        return found

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        found = self.circuit.validity_warnings(columns, ambient)
        for name in self.prefixes:
            found |= with_prefix(name, self.tube.validity_warnings(select_prefix(name, columns), ambient))
        return found

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        held = [select_prefix(name, state) for name in self.prefixes]
        along = [self.tube.air_states(content, ambient) for content in held]
        done = self.circuit.supplied_flow(inlet, tuple(pieces[0] for pieces in along), state, inputs, ambient)
        rates, outputs, flows = dict(done.rates), dict(done.outputs), []
        for name, content, pieces, flow, air in zip(self.prefixes, held, along, done.flows, airs, strict=True):
            of_tube, onward = self.tube.rates(content, pieces, flow, air, ambient)
            rates |= with_prefix(name, of_tube)
            for piece, inside in zip(self.tube.prefixes, pieces, strict=True):
                outputs[f"{name}{piece}pressure"] = gauge_pressure(inside.pressure, ambient)
            flows.append(onward)
        return CircuitFlows(tuple(flows), done.drawn, done.exhausted, rates, outputs)
