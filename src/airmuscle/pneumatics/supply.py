"""Where the air comes from: ideal, through a regulator, from a tank that sags."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from ..core import ops
from ..core.errors import ParameterError
from ..core.model import model, parameter
from ..core.ops import Value
from ..core.variables import StateVariable, outside, renamed, within
from .flow import opened, through
from .gas import Air, Ambient, Flow, Gas, Isothermal, absolute
from .orifice import Orifice


class Source(abc.ABC):
    """A source of air with states of its own."""

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """Its states; none, if its pressure does not change."""
        return ()

    def settled(self, ambient: Ambient) -> dict[str, Value]:
        """Its states where nothing has been drawn for long."""
        return {}

    @abc.abstractmethod
    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        """The air at its outlet."""

    def balance(self, state: Mapping[str, Value], drawn: Flow, ambient: Ambient) -> tuple[dict[str, Value], Flow]:
        """Rates of its states while air is drawn, and the flow that it takes from the world outside the plant."""
        return {}, drawn


@model
class Supply(Source):
    """Air at a constant pressure and at ambient temperature."""

    pressure: float = parameter("Pa", "p_s", "gauge pressure of the supply", bounds=(-1e5, 5e6))

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        return Air(absolute(self.pressure, ambient), ambient.temperature)


@model
class Shared(Source):
    """The supply of a branch in a `Manifold`, which feeds all its branches from one supply of its own."""

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        raise ParameterError("Shared() is the supply of a branch in a Manifold; it has no air of its own.")


def refuse_shared(owner: str, supply: Source) -> None:
    """Raise ParameterError for a Shared() where no manifold stands before it."""
    if isinstance(supply, Shared):
        raise ParameterError(
            f"{owner}: Shared() is the supply of a branch in a Manifold, which has one of its own; here give a Supply, "
            "a Tank or a RegulatedSupply."
        )


@model
class Tank(Source):
    """A vessel that is fed through an orifice and sags while air is drawn faster than it comes in.

    m' = q_feed - q_drawn, pressure by the gas. It begins at the pressure of what feeds it; a feed of conductance 0
    leaves it to itself.
    """

    supply: Source
    feed: Orifice
    volume: float = parameter("m3", "V_T", "volume of the tank", bounds=(1e-6, 1e2))
    gas: Gas = Isothermal()

    def check(self) -> None:
        refuse_shared("Tank", self.supply)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return (*self.gas.states(self.volume, ambient), *renamed("supply.", self.supply.states(ambient)))

    def settled(self, ambient: Ambient) -> dict[str, Value]:
        before = self.supply.settled(ambient)
        pressure = self.supply.air(before, ambient).pressure
        return {**self.gas.content(pressure, self.volume, ambient), **outside("supply.", before)}

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        return self.gas.air(state, self.volume, ambient)

    def balance(self, state: Mapping[str, Value], drawn: Flow, ambient: Ambient) -> tuple[dict[str, Value], Flow]:
        before, inside = within("supply.", state), self.air(state, ambient)
        fed = through(self.feed, self.supply.air(before, ambient), inside)
        further, taken = self.supply.balance(before, fed, ambient)
        rates = self.gas.rates(state, inside, fed - drawn, 0.0, ambient)
        return {**rates, **outside("supply.", further)}, taken


@model
class RegulatedSupply(Source):
    """A pressure regulator in the line: it opens as its outlet falls below the pressure that it is set to.

        opening = clip((p_set - p)/B, 0, 1)

    p outlet pressure, B proportional band, in which the outlet droops from no flow to full flow. It relieves nothing;
    air flows back through it where its own supply has fallen below the outlet. It begins at the pressure that it is
    set to, or at that of its supply where this is lower.
    """

    supply: Source
    valve: Orifice
    pressure: float = parameter("Pa", "p_set", "gauge pressure that it is set to", bounds=(0.0, 2e6))
    band: float = parameter("Pa", "B", "droop from no flow to full flow", bounds=(100.0, 1e6), default=2e4)
    volume: float = parameter("m3", "V_r", "volume of its outlet", bounds=(1e-7, 1.0), default=5e-5)
    gas: Gas = Isothermal()

    def check(self) -> None:
        refuse_shared("RegulatedSupply", self.supply)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return (*self.gas.states(self.volume, ambient), *renamed("supply.", self.supply.states(ambient)))

    def settled(self, ambient: Ambient) -> dict[str, Value]:
        before = self.supply.settled(ambient)
        pressure = ops.minimum(absolute(self.pressure, ambient), self.supply.air(before, ambient).pressure)
        return {**self.gas.content(pressure, self.volume, ambient), **outside("supply.", before)}

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        return self.gas.air(state, self.volume, ambient)

    def balance(self, state: Mapping[str, Value], drawn: Flow, ambient: Ambient) -> tuple[dict[str, Value], Flow]:
        before, inside = within("supply.", state), self.air(state, ambient)
        opening = opened(absolute(self.pressure, ambient) - inside.pressure, self.band)
        fed = through(self.valve, self.supply.air(before, ambient), inside, opening)
        further, taken = self.supply.balance(before, fed, ambient)
        rates = self.gas.rates(state, inside, fed - drawn, 0.0, ambient)
        return {**rates, **outside("supply.", further)}, taken
