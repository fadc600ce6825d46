"""Circuits made of circuits: one that leaks, and several on one supply."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from ..core.declaration import check_structure, model
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.variables import Input, StateVariable, add_prefix, select_prefix, with_prefix
from .circuit import SUPPLY, Circuit, CircuitFlows
from .fill_discharge import ambient_air
from .flow import orifice_flow
from .gas import Air, Ambient
from .orifice import Orifice
from .supply import AirSource, SharedSupply
from .wrapper import CircuitWrapper


@model
class WithLeak(CircuitWrapper):
    """A circuit whose muscles also lose air to the surroundings through a leak each."""

    circuit: Circuit
    leak: Orifice

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return self.circuit.own_states(ambient)

    def own_steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return self.circuit.own_steady_state(airs, ambient)

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        done = self.circuit.supplied_flow(inlet, airs, state, inputs, ambient)
        lost = [orifice_flow(self.leak, air, ambient_air(ambient)) for air in airs]
        flows = tuple(flow - leaking for flow, leaking in zip(done.flows, lost, strict=True))
        return dataclasses.replace(done, flows=flows, exhausted=sum(lost, done.exhausted))


@model
class Manifold(Circuit):
    """Several circuits on one supply, so that one that draws much starves the others; each has a name."""

    supply: AirSource
    branches: tuple[Circuit, ...]
    names: tuple[str, ...]

    def check(self) -> None:
        check_structure(self)
        for field, kind in (("branches", Circuit), ("names", str)):
            given = getattr(self, field)
            if not isinstance(given, tuple) or not all(isinstance(item, kind) for item in given):
                raise ParameterError(f"Manifold: its {field} must be a tuple of {kind.__name__}; they are {given!r}.")
        if len(self.names) != len(self.branches) or len(set(self.names)) != len(self.names) or not self.names:
            raise ParameterError(f"Manifold: {len(self.branches)} branches need as many different names: {self.names}.")
        for name in self.names:
            if not name or "." in name or f"{name}." == SUPPLY:
                raise ParameterError(
                    f"Manifold: a branch cannot be named {name!r}; give a word without a dot, and not 'supply', which "
                    "names the manifold's own."
                )
        for name, branch in zip(self.names, self.branches, strict=True):
            if not isinstance(branch.supply, SharedSupply):
                raise ParameterError(
                    f"Manifold: branch '{name}' has a supply of its own; give it SharedSupply(), as the manifold feeds it."
                )

    def _named_branches(self) -> Iterator[tuple[str, Circuit]]:
        return zip((f"{name}." for name in self.names), self.branches, strict=True)

    @property
    def port_count(self) -> int:
        return sum(branch.port_count for branch in self.branches)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return tuple(i for name, branch in self._named_branches() for i in add_prefix(name, branch.inputs))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return tuple(s for name, branch in self._named_branches() for s in add_prefix(name, branch.own_states(ambient)))

    def own_steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        found: dict[str, Value] = {}
        left = list(airs)
        for name, branch in self._named_branches():
            mine, left = tuple(left[: branch.port_count]), left[branch.port_count :]
            found |= with_prefix(name, branch.own_steady_state(mine, ambient))
        return found

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        found: dict[str, str] = {}
        for name, branch in self._named_branches():
            found |= with_prefix(name, branch.validity_warnings(select_prefix(name, columns), ambient))
        return found

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        total, left = CircuitFlows(()), list(airs)
        for name, branch in self._named_branches():
            mine, left = tuple(left[: branch.port_count]), left[branch.port_count :]
            done = branch.supplied_flow(inlet, mine, select_prefix(name, state), select_prefix(name, inputs), ambient)
            total = CircuitFlows(
                total.flows + done.flows, total.drawn + done.drawn, total.exhausted + done.exhausted,
                {**total.rates, **with_prefix(name, done.rates)}, {**total.outputs, **with_prefix(name, done.outputs)},
            )  # fmt: skip
        return total
