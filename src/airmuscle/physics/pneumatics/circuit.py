"""Circuit (interface) from an air supply through valves to the muscles; circuits of on/off valves,
closed chamber.
"""

import abc
import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from ...core import ParameterError, Reference, Value, Values, model, ops
from ...core.declaration import forwarded
from ...core.system import Input, StateVariable, add_prefix, select_prefix, with_prefix
from .gas import NO_FLOW, Air, Airs, Ambient, Flow
from .supply import AirSource, SharedSupply, Supply
from .valve import Orifice, orifice_flow

SUPPLY = "supply."
"""Prefix of the state names of the supply."""


@dataclasses.dataclass(frozen=True)
class CircuitFlows:
    """Flows, rates and outputs of a circuit at one instant.

    `flows` are the flows into each muscle, `drawn` is the flow from the supply, `exhausted` the
    flow to the surroundings, `rates` are the time derivatives of the circuit's states and `outputs`
    additional quantities by name.
    """

    flows: tuple[Flow, ...]
    drawn: Flow = NO_FLOW
    exhausted: Flow = NO_FLOW
    rates: Values = dataclasses.field(default_factory=dict)
    outputs: Values = dataclasses.field(default_factory=dict)

    def __add__(self, other: "CircuitFlows") -> "CircuitFlows":
        """The flows of two circuits on one supply."""
        return CircuitFlows(
            self.flows + other.flows,
            self.drawn + other.drawn,
            self.exhausted + other.exhausted,
            {**self.rates, **other.rates},
            {**self.outputs, **other.outputs},
        )


class Circuit(abc.ABC):
    """Pneumatic circuit of one or more muscles: inputs, states and the flows into the muscles
    (interface).
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    supply: AirSource

    @property
    def holds_pressure(self) -> bool:
        """Whether it controls the pressure of its muscles, so that their air is never shut in."""
        return False

    @property
    def port_count(self) -> int:
        """Number of muscles that the circuit feeds."""
        return 1

    @property
    @abc.abstractmethod
    def inputs(self) -> tuple[Input, ...]:
        """Inputs of the circuit: valve openings, commands or set points."""

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables without those of the supply."""
        return ()

    def own_steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        """Steady state without the supply, for zero inputs and the air states of the muscles."""
        return {}

    @abc.abstractmethod
    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        """Flows for the air state at the supply and the air states of the muscles; `rates` without
        the supply.
        """

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Warnings by prefix of the part where a run left the validity range; `columns` are arrays
        (N,) by name.
        """
        return {}

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables of circuit and supply."""
        return (*self.own_states(ambient), *add_prefix(SUPPLY, self.supply.states(ambient)))

    def steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        """Steady state of circuit and supply for zero inputs and the air states of the muscles."""
        return {
            **self.own_steady_state(muscles, ambient),
            **with_prefix(SUPPLY, self.supply.steady_state(ambient)),
        }

    def compute_flows(
        self, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        """Flows and rates of circuit and supply; `drawn` is the flow from outside the plant."""
        supply = select_prefix(SUPPLY, state)
        flows = self.supplied_flow(
            self.supply.air(supply, ambient), muscles, state, inputs, ambient
        )
        rates, inflow = self.supply.balance(supply, flows.drawn, ambient)
        return dataclasses.replace(
            flows, rates={**flows.rates, **with_prefix(SUPPLY, rates)}, drawn=inflow
        )


class CircuitWrapper(Circuit, abc.ABC):
    """Wrapper between a circuit and its muscles; supply, ports and inputs are those of the inner
    circuit.
    """

    circuit: Circuit

    supply = forwarded("circuit.supply")
    port_count = forwarded("circuit.port_count")
    holds_pressure = forwarded("circuit.holds_pressure")
    inputs = forwarded("circuit.inputs")
    own_states = forwarded("circuit.own_states")
    own_steady_state = forwarded("circuit.own_steady_state")
    validity_warnings = forwarded("circuit.validity_warnings")


def port_prefix(number: int) -> str:
    """Prefix of the names that belong to a port, counted from 1, of a circuit with several
    ports.
    """
    return f"port{number}."


def ambient_air(ambient: Ambient) -> Air:
    """Air state of the surroundings."""
    return Air(ambient.pressure, ambient.temperature)


@model
class ValvePair(Circuit):
    """Circuit with a fill valve from the supply and a discharge valve to the surroundings (base
    class).
    """

    supply: AirSource
    fill: Orifice
    discharge: Orifice

    def valve_flows(
        self, inlet: Air, air: Air, opened: Value, vented: Value, ambient: Ambient
    ) -> CircuitFlows:
        """Flows at these openings of the two valves."""
        inflow = orifice_flow(self.fill, inlet, air, opened)
        outflow = orifice_flow(self.discharge, air, ambient_air(ambient), vented)
        return CircuitFlows((inflow - outflow,), inflow, outflow)


@model
class FillDischarge(ValvePair):
    """Two on/off valves: a fill valve from the supply and a discharge valve to the surroundings."""

    inputs = (Input("fill"), Input("discharge"))

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        return self.valve_flows(inlet, muscles[0], inputs["fill"], inputs["discharge"], ambient)


@model
class ThreePositionValve(ValvePair):
    """3/3 valve with closed centre and one input `valve`: 1 fill, 0 closed, -1 discharge;
    proportional between.
    """

    inputs = (Input("valve", "1", -1.0, 1.0, "1 fill, 0 closed, -1 discharge"),)

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        position = inputs["valve"]
        return self.valve_flows(
            inlet, muscles[0], ops.maximum(position, 0.0), ops.maximum(-position, 0.0), ambient
        )


@model
class ClosedChamber(Circuit):
    """Closed chamber: no flow, constant air mass."""

    supply: AirSource = Supply(0.0)

    inputs = ()

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        return CircuitFlows((NO_FLOW,))


@model
class WithLeak(CircuitWrapper):
    """Circuit with a leak from each of its muscles to the surroundings."""

    circuit: Circuit
    leak: Orifice

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        inner = self.circuit.supplied_flow(inlet, muscles, state, inputs, ambient)
        outside = ambient_air(ambient)
        leakage = [orifice_flow(self.leak, air, outside) for air in muscles]
        flows = tuple(flow - leak for flow, leak in zip(inner.flows, leakage, strict=True))
        exhausted = sum(leakage, inner.exhausted)
        return dataclasses.replace(inner, flows=flows, exhausted=exhausted)


@model
class Manifold(Circuit):
    """Manifold: several named circuits on one supply; a large flow in one reduces the supply
    pressure of all.
    """

    supply: AirSource
    branches: tuple[Circuit, ...]
    names: tuple[str, ...]

    def check(self) -> None:
        if (
            len(self.names) != len(self.branches)
            or len(set(self.names)) != len(self.names)
            or not self.names
        ):
            raise ParameterError(
                f"Manifold: names is {self.names}; give a distinct name for each of the"
                f" {len(self.branches)} branches."
            )
        for name in self.names:
            if not name or "." in name or f"{name}." == SUPPLY:
                raise ParameterError(
                    f"Manifold: a branch cannot be named {name!r}; give a name without a dot and"
                    " other than 'supply', which is reserved for the supply of the manifold."
                )
        for name, branch in zip(self.names, self.branches, strict=True):
            if not isinstance(branch.supply, SharedSupply):
                raise ParameterError(
                    f"Manifold: the supply of branch '{name}' is {type(branch.supply).__name__}; it"
                    " must be SharedSupply(), because the manifold feeds all branches."
                )

    @property
    def holds_pressure(self) -> bool:
        return all(branch.holds_pressure for branch in self.branches)

    def _named_branches(self) -> Iterator[tuple[str, Circuit]]:
        return zip((f"{name}." for name in self.names), self.branches, strict=True)

    def _branch_air(self, muscles: Airs) -> Iterator[tuple[str, Circuit, tuple[Air, ...]]]:
        """Prefix and circuit of each branch, with the air states of its muscles."""
        first = 0
        for name, branch in self._named_branches():
            yield name, branch, muscles[first : first + branch.port_count]
            first += branch.port_count

    @property
    def port_count(self) -> int:
        return sum(branch.port_count for branch in self.branches)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return tuple(
            i for name, branch in self._named_branches() for i in add_prefix(name, branch.inputs)
        )

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return tuple(
            s
            for name, branch in self._named_branches()
            for s in add_prefix(name, branch.own_states(ambient))
        )

    def own_steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        state: dict[str, Value] = {}
        for name, branch, branch_air in self._branch_air(muscles):
            state |= with_prefix(name, branch.own_steady_state(branch_air, ambient))
        return state

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        warnings: dict[str, str] = {}
        for name, branch in self._named_branches():
            warnings |= with_prefix(
                name, branch.validity_warnings(select_prefix(name, columns), ambient)
            )
        return warnings

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        total = CircuitFlows(())
        for name, branch, branch_air in self._branch_air(muscles):
            branch_state = select_prefix(name, state)
            commands = select_prefix(name, inputs)
            part = branch.supplied_flow(inlet, branch_air, branch_state, commands, ambient)
            rates = with_prefix(name, part.rates)
            outputs = with_prefix(name, part.outputs)
            total += dataclasses.replace(part, rates=rates, outputs=outputs)
        return total
