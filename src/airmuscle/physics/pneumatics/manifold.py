"""WithLeak and Manifold: a circuit with leakage, and several circuits on one supply."""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from ...core import ParameterError, Value, Values, check_structure, model
from ...core.system import Input, StateVariable, add_prefix, select_prefix, with_prefix
from .circuit import SUPPLY, Circuit, CircuitFlows, CircuitWrapper, ambient_air
from .gas import Air, Ambient
from .supply import AirSource, SharedSupply
from .valve import Orifice, orifice_flow


@model
class WithLeak(CircuitWrapper):
    """Circuit with a leak from each of its muscles to the surroundings."""

    circuit: Circuit
    leak: Orifice

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return self.circuit.own_states(ambient)

    def own_steady_state(self, air_states: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return self.circuit.own_steady_state(air_states, ambient)

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        inner = self.circuit.supplied_flow(inlet, air_states, state, inputs, ambient)
        leakage = [orifice_flow(self.leak, air, ambient_air(ambient)) for air in air_states]
        flows = tuple(flow - leak for flow, leak in zip(inner.flows, leakage, strict=True))
        return dataclasses.replace(inner, flows=flows, exhausted=sum(leakage, inner.exhausted))


@model
class Manifold(Circuit):
    """Manifold: several named circuits on one supply; a large flow in one reduces the supply pressure of all."""

    supply: AirSource
    branches: tuple[Circuit, ...]
    names: tuple[str, ...]

    def check(self) -> None:
        check_structure(self)
        for field, kind in (("branches", Circuit), ("names", str)):
            value = getattr(self, field)
            if not isinstance(value, tuple) or not all(isinstance(item, kind) for item in value):
                raise ParameterError(f"Manifold: {field} is {value!r}; it must be a tuple of {kind.__name__}.")
        if len(self.names) != len(self.branches) or len(set(self.names)) != len(self.names) or not self.names:
            raise ParameterError(
                f"Manifold: names is {self.names}; give a distinct name for each of the {len(self.branches)} branches."
            )
        for name in self.names:
            if not name or "." in name or f"{name}." == SUPPLY:
                raise ParameterError(
                    f"Manifold: a branch cannot be named {name!r}; give a name without a dot and other than 'supply', "
                    "which is reserved for the supply of the manifold."
                )
        for name, branch in zip(self.names, self.branches, strict=True):
            if not isinstance(branch.supply, SharedSupply):
                raise ParameterError(
                    f"Manifold: the supply of branch '{name}' is {type(branch.supply).__name__}; it must be "
                    "SharedSupply(), because the manifold feeds all branches."
                )

    def _named_branches(self) -> Iterator[tuple[str, Circuit]]:
        return zip((f"{name}." for name in self.names), self.branches, strict=True)

    def _branch_air(self, air_states: tuple[Air, ...]) -> Iterator[tuple[str, Circuit, tuple[Air, ...]]]:
        """Prefix and circuit of each branch, with the air states of its muscles."""
        first = 0
        for name, branch in self._named_branches():
            yield name, branch, air_states[first : first + branch.port_count]
            first += branch.port_count

    @property
    def port_count(self) -> int:
        return sum(branch.port_count for branch in self.branches)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return tuple(i for name, branch in self._named_branches() for i in add_prefix(name, branch.inputs))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return tuple(s for name, branch in self._named_branches() for s in add_prefix(name, branch.own_states(ambient)))

    def own_steady_state(self, air_states: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        state: dict[str, Value] = {}
        for name, branch, branch_air in self._branch_air(air_states):
            state |= with_prefix(name, branch.own_steady_state(branch_air, ambient))
        return state

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        warnings: dict[str, str] = {}
        for name, branch in self._named_branches():
            warnings |= with_prefix(name, branch.validity_warnings(select_prefix(name, columns), ambient))
        return warnings

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        total = CircuitFlows(())
        for name, branch, branch_air in self._branch_air(air_states):
            part = branch.supplied_flow(
                inlet, branch_air, select_prefix(name, state), select_prefix(name, inputs), ambient
            )
            total = CircuitFlows(
                total.flows + part.flows, total.drawn + part.drawn, total.exhausted + part.exhausted,
                {**total.rates, **with_prefix(name, part.rates)}, {**total.outputs, **with_prefix(name, part.outputs)},
            )  # fmt: skip
        return total
