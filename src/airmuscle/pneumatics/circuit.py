"""What a circuit is: it takes air from a supply, and gives each muscle the flow that its valves let through."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import Input, StateVariable, add_prefix, select_prefix, with_prefix
from .gas import NO_FLOW, Air, Ambient, Flow
from .supply import AirSource

SUPPLY = "supply."
"""What the names of the supply's states begin with."""


@dataclasses.dataclass(frozen=True)
class CircuitFlows:
    """What a circuit does at one moment: flow into every muscle, rates of its own states, what one may want to see.

    `drawn` is what it takes from its supply, `exhausted` what it gives to the surroundings.
    """

    flows: tuple[Flow, ...]
    drawn: Flow = NO_FLOW
    exhausted: Flow = NO_FLOW
    rates: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    outputs: Mapping[str, Value] = dataclasses.field(default_factory=dict)


class Circuit(abc.ABC):
    """The pneumatic side of one muscle or more: inputs that are commanded, states, and the flow that follows."""

    references: ClassVar[tuple[Reference, ...]] = ()
    supply: AirSource

    @property
    def port_count(self) -> int:
        """How many muscles it feeds."""
        return 1

    @property
    @abc.abstractmethod
    def inputs(self) -> tuple[Input, ...]:
        """What is commanded."""

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """Its states without those of its supply."""
        return ()

    def own_steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        """Its own states at rest, with every input at zero and this air in the muscles."""
        return {}

    @abc.abstractmethod
    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        """What it does between this air at its supply and this air in the muscles."""

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Where a run, columns (N,) by its names, went beyond what its laws describe: in words, by part."""
        return {}

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """All its states."""
        return (*self.own_states(ambient), *add_prefix(SUPPLY, self.supply.states(ambient)))

    def steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        """All its states at rest."""
        return {**self.own_steady_state(airs, ambient), **with_prefix(SUPPLY, self.supply.steady_state(ambient))}

    def compute_flows(
        self, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value], ambient: Ambient
    ) -> CircuitFlows:
        """What it does with this air in the muscles; `drawn` is then what comes from outside the plant."""
        of_supply = select_prefix(SUPPLY, state)
        done = self.supplied_flow(self.supply.air(of_supply, ambient), airs, state, inputs, ambient)
        rates, taken = self.supply.balance(of_supply, done.drawn, ambient)
        return dataclasses.replace(done, rates={**done.rates, **with_prefix(SUPPLY, rates)}, drawn=taken)
