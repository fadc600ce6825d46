"""The tube between a valve and a muscle: volume and resistance, in one piece or many."""

from __future__ import annotations

from collections.abc import Mapping

from ..declare import model, parameter
from ..errors import ParameterError
from ..gas import Air, Ambient, Flow, Gas, Isothermal, gauge
from ..ops import Value
from ..variables import Input, StateVariable, outside, renamed, within
from .circuit import Circuit, Response
from .orifice import Orifice
from .supply import Source
from .through import through


@model
class Tube:
    """A volume, and an orifice from it to the muscle; or `pieces` of them one after the other.

    `orifice` is the whole tube's. Each of n pieces has 1/n of the volume and sqrt(n) times the conductance, which is
    exact for the flow law of a tube with friction, q^2 = C^2 (p_1^2 - p_2^2), that is for a critical ratio of 0.
    """

    orifice: Orifice
    volume: float = parameter("m3", "V_t", "volume of the tube", bounds=(1e-9, 1e-2))
    pieces: int = 1
    gas: Gas = Isothermal()

    def check(self) -> None:
        if not (isinstance(self.pieces, int) and 1 <= self.pieces <= 200):
            raise ParameterError(f"Tube: pieces is {self.pieces!r}; give a whole number from 1 to 200.")

    @property
    def names(self) -> tuple[str, ...]:
        """What the names of each piece's states begin with, from the valve to the muscle."""
        return ("tube.",) if self.pieces == 1 else tuple(f"tube{i}." for i in range(1, self.pieces + 1))

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """What its pieces hold."""
        of_piece = self.gas.states(self.volume / self.pieces, ambient)
        return tuple(state for name in self.names for state in renamed(name, of_piece))

    def settled(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        """What its pieces hold at the pressure of the muscle."""
        content = self.gas.content(air.pressure, self.volume / self.pieces, ambient)
        return {name: value for prefix in self.names for name, value in outside(prefix, content).items()}

    def airs(self, state: Mapping[str, Value], ambient: Ambient) -> tuple[Air, ...]:
        """The air in every piece."""
        return tuple(self.gas.air(within(n, state), self.volume / self.pieces, ambient) for n in self.names)

    def rates(
        self, state: Mapping[str, Value], airs: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        """Rates of its states while `flow` comes in from the valve, and the flow into the muscle."""
        rates: dict[str, Value] = {}
        for name, air, after in zip(self.names, airs, (*airs[1:], muscle), strict=True):
            onward = through(self.orifice, air, after, self.pieces**0.5)
            rates |= outside(name, self.gas.rates(within(name, state), air, flow - onward, 0.0, ambient))
            flow = onward
        return rates, flow


@model
class Line(Circuit):
    """A tube between a circuit's valves and each of its muscles.

    `tube.pressure` is that in the tube; with several pieces `tube1.pressure`, ... from the valve on.
    """

    circuit: Circuit
    tube: Tube

    @property
    def supply(self) -> Source:  # type: ignore[override]  # the circuit's own
        return self.circuit.supply

    @property
    def ports(self) -> int:
        return self.circuit.ports

    @property
    def inputs(self) -> tuple[Input, ...]:
        return self.circuit.inputs

    @property
    def names(self) -> tuple[str, ...]:
        """What the names of each muscle's tube begin with."""
        return ("",) if self.ports == 1 else tuple(f"{i}." for i in range(1, self.ports + 1))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        of_tube = self.tube.states(ambient)
        return (*self.circuit.own_states(ambient), *(s for name in self.names for s in renamed(name, of_tube)))

    def own_settled(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        found = self.circuit.own_settled(airs, ambient)
        for name, air in zip(self.names, airs, strict=True):
            found |= outside(name, self.tube.settled(air, ambient))
        return found

    def draw(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> Response:  # fmt: skip
        held = [within(name, state) for name in self.names]
        along = [self.tube.airs(content, ambient) for content in held]
        done = self.circuit.draw(inlet, tuple(pieces[0] for pieces in along), state, inputs, ambient)
        rates, outputs, flows = dict(done.rates), dict(done.outputs), []
        for name, content, pieces, flow, air in zip(self.names, held, along, done.flows, airs, strict=True):
            of_tube, onward = self.tube.rates(content, pieces, flow, air, ambient)
            rates |= outside(name, of_tube)
            for piece, inside in zip(self.tube.names, pieces, strict=True):
                outputs[f"{name}{piece}pressure"] = gauge(inside.pressure, ambient)
            flows.append(onward)
        return Response(tuple(flows), done.drawn, done.exhausted, rates, outputs)
