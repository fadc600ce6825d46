"""Where the air comes from: ideal, through a regulator, from a tank that sags."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.variables import StateVariable, add_prefix, select_prefix, with_prefix
from .flow import orifice_flow, proportional_opening
from .gas import Air, Ambient, Flow, Gas, Isothermal, absolute_pressure
from .orifice import Orifice


class AirSource(abc.ABC):
    """A source of air with states of its own."""

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """Its states; none, if its pressure does not change."""
        return ()

    def steady_state(self, ambient: Ambient) -> dict[str, Value]:
        """Its states where nothing has been drawn for long."""
        return {}

    @abc.abstractmethod
    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        """The air at its outlet."""

    def balance(self, state: Mapping[str, Value], drawn: Flow, ambient: Ambient) -> tuple[dict[str, Value], Flow]:
        """Rates of its states while air is drawn, and the flow that it takes from the world outside the plant."""
        return {}, drawn


@model
class Supply(AirSource):
    """Air at a constant pressure and at ambient temperature."""

    pressure: float = parameter("Pa", "p_s", "gauge pressure of the supply", bounds=(-1e5, 5e6))

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        return Air(absolute_pressure(self.pressure, ambient), ambient.temperature)


@model
class SharedSupply(AirSource):
    """The supply of a branch in a `Manifold`, which feeds all its branches from one supply of its own."""

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        raise ParameterError("SharedSupply() is the supply of a branch in a Manifold; it has no air of its own.")


def check_not_shared(owner: str, supply: AirSource) -> None:
    """Raise ParameterError for a SharedSupply() where no manifold stands before it."""
    if isinstance(supply, SharedSupply):
        raise ParameterError(
            f"{owner}: SharedSupply() is the supply of a branch in a Manifold, which has one of its own; here give a Supply, "
            "a Tank or a RegulatedSupply."
        )


@model
class Tank(AirSource):
    """A vessel that is fed through an orifice and sags while air is drawn faster than it comes in.

    m' = q_feed - q_drawn, pressure by the gas. It begins at the pressure of what feeds it; a feed of conductance 0
    leaves it to itself.
    """

    supply: AirSource
    feed: Orifice
    volume: float = parameter("m3", "V_T", "volume of the tank", bounds=(1e-6, 1e2))
    gas: Gas = Isothermal()

    def check(self) -> None:
        check_not_shared("Tank", self.supply)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return (*self.gas.states(self.volume, ambient), *add_prefix("supply.", self.supply.states(ambient)))

    def steady_state(self, ambient: Ambient) -> dict[str, Value]:
        before = self.supply.steady_state(ambient)
        pressure = self.supply.air(before, ambient).pressure
        return {**self.gas.state_at(pressure, self.volume, ambient), **with_prefix("supply.", before)}

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        return self.gas.air(state, self.volume, ambient)

    def balance(self, state: Mapping[str, Value], drawn: Flow, ambient: Ambient) -> tuple[dict[str, Value], Flow]:
        before, inside = select_prefix("supply.", state), self.air(state, ambient)
        fed = orifice_flow(self.feed, self.supply.air(before, ambient), inside)
        further, taken = self.supply.balance(before, fed, ambient)
        rates = self.gas.rates(state, inside, fed - drawn, 0.0, ambient)
        return {**rates, **with_prefix("supply.", further)}, taken


@model
class RegulatedSupply(AirSource):
    """A pressure regulator in the line: it opens as its outlet falls below the pressure that it is set to.

        opening = clip((p_set - p)/B, 0, 1)

    p outlet pressure, B proportional band, in which the outlet droops from no flow to full flow. It relieves nothing;
    air flows back through it where its own supply has fallen below the outlet. It begins at the pressure that it is
    set to, or at that of its supply where this is lower.
    """

    supply: AirSource
    valve: Orifice
    pressure: float = parameter("Pa", "p_set", "gauge pressure that it is set to", bounds=(0.0, 2e6))
    band: float = parameter("Pa", "B", "droop from no flow to full flow", bounds=(100.0, 1e6), default=2e4)
    volume: float = parameter("m3", "V_r", "volume of its outlet", bounds=(1e-7, 1.0), default=5e-5)
    gas: Gas = Isothermal()

    def check(self) -> None:
        check_not_shared("RegulatedSupply", self.supply)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return (*self.gas.states(self.volume, ambient), *add_prefix("supply.", self.supply.states(ambient)))

    def steady_state(self, ambient: Ambient) -> dict[str, Value]:
        before = self.supply.steady_state(ambient)
        pressure = ops.minimum(absolute_pressure(self.pressure, ambient), self.supply.air(before, ambient).pressure)
        return {**self.gas.state_at(pressure, self.volume, ambient), **with_prefix("supply.", before)}

    def air(self, state: Mapping[str, Value], ambient: Ambient) -> Air:
        return self.gas.air(state, self.volume, ambient)

    def balance(self, state: Mapping[str, Value], drawn: Flow, ambient: Ambient) -> tuple[dict[str, Value], Flow]:
        before, inside = select_prefix("supply.", state), self.air(state, ambient)
        opening = proportional_opening(absolute_pressure(self.pressure, ambient) - inside.pressure, self.band)
        fed = orifice_flow(self.valve, self.supply.air(before, ambient), inside, opening)
        further, taken = self.supply.balance(before, fed, ambient)
        rates = self.gas.rates(state, inside, fed - drawn, 0.0, ambient)
        return {**rates, **with_prefix("supply.", further)}, taken
