"""Circuits made of circuits: one that leaks, and several on one supply."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from ..core.errors import ParameterError
from ..core.model import model, refuse_misplaced
from ..core.ops import Value
from ..core.variables import Input, StateVariable, outside, renamed, within
from .circuit import SUPPLY, Circuit, Response
from .fill_discharge import surroundings
from .flow import through
from .gas import Air, Ambient
from .orifice import Orifice
from .supply import Shared, Source
from .wrapper import Around


@model
class Leaking(Around):
    """A circuit whose muscles also lose air to the surroundings through a leak each."""

    circuit: Circuit
    leak: Orifice

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return self.circuit.own_states(ambient)

    def own_settled(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return self.circuit.own_settled(airs, ambient)

    def draw(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> Response:  # fmt: skip
        done = self.circuit.draw(inlet, airs, state, inputs, ambient)
        lost = [through(self.leak, air, surroundings(ambient)) for air in airs]
        flows = tuple(flow - leaking for flow, leaking in zip(done.flows, lost, strict=True))
        return dataclasses.replace(done, flows=flows, exhausted=sum(lost, done.exhausted))


@model
class Manifold(Circuit):
    """Several circuits on one supply, so that one that draws much starves the others; each has a name."""

    supply: Source
    branches: tuple[Circuit, ...]
    names: tuple[str, ...]

    def check(self) -> None:
        refuse_misplaced(self)
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
            if not isinstance(branch.supply, Shared):
                raise ParameterError(
                    f"Manifold: branch '{name}' has a supply of its own; give it Shared(), as the manifold feeds it."
                )

    def _parts(self) -> Iterator[tuple[str, Circuit]]:
        return zip((f"{name}." for name in self.names), self.branches, strict=True)

    @property
    def ports(self) -> int:
        return sum(branch.ports for branch in self.branches)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return tuple(i for name, branch in self._parts() for i in renamed(name, branch.inputs))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return tuple(s for name, branch in self._parts() for s in renamed(name, branch.own_states(ambient)))

    def own_settled(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        found: dict[str, Value] = {}
        left = list(airs)
        for name, branch in self._parts():
            mine, left = tuple(left[: branch.ports]), left[branch.ports :]
            found |= outside(name, branch.own_settled(mine, ambient))
        return found

    def doubts(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        found: dict[str, str] = {}
        for name, branch in self._parts():
            found |= outside(name, branch.doubts(within(name, columns), ambient))
        return found

    def draw(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> Response:  # fmt: skip
        total, left = Response(()), list(airs)
        for name, branch in self._parts():
            mine, left = tuple(left[: branch.ports]), left[branch.ports :]
            done = branch.draw(inlet, mine, within(name, state), within(name, inputs), ambient)
            total = Response(
                total.flows + done.flows, total.drawn + done.drawn, total.exhausted + done.exhausted,
                {**total.rates, **outside(name, done.rates)}, {**total.outputs, **outside(name, done.outputs)},
            )  # fmt: skip
        return total
