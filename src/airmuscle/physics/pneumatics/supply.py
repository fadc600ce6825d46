"""Air supplies: constant pressure, tank, and pressure regulator."""

import abc

from ...core import ParameterError, Value, Values, model, ops, parameter
from ...core.system import StateVariable, add_prefix, select_prefix, with_prefix
from .gas import Air, Ambient, Flow, Gas, Isothermal, absolute_pressure, gauge_pressure
from .valve import Orifice, orifice_flow, proportional_opening


class AirSource(abc.ABC):
    """Air supply, possibly with states (interface)."""

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables; none for a constant pressure."""
        return ()

    def steady_state(self, ambient: Ambient) -> dict[str, Value]:
        """Steady state without flow."""
        return {}

    @abc.abstractmethod
    def air(self, state: Values, ambient: Ambient) -> Air:
        """Air state at the outlet."""

    def balance(
        self, state: Values, drawn: Flow, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        """Time derivatives of the states for a drawn flow, and the flow into the supply from
        outside the plant.
        """
        return {}, drawn

    def check_ambient(self, ambient: Ambient) -> None:
        """Raise ParameterError where the supply cannot exist in this ambient air; by default
        nothing is raised.
        """
        return None


@model
class Supply(AirSource):
    """Ideal supply: constant pressure at ambient temperature.

    A pressure below 1 kPa (chosen), such as 6 for 6 bar, causes an AirmuscleWarning, except zero.
    """

    pressure: float = parameter(
        "Pa", "p_s", "gauge pressure of the supply", bounds=(-1e5, 5e6), plausible=1e3
    )

    def air(self, state: Values, ambient: Ambient) -> Air:
        return Air(absolute_pressure(self.pressure, ambient), ambient.temperature)

    def check_ambient(self, ambient: Ambient) -> None:
        """Raise ParameterError for a pressure that is not above absolute vacuum."""
        if not absolute_pressure(self.pressure, ambient) > 0.0:
            vacuum = f"{gauge_pressure(0.0, ambient) / 1e3:.4g} kPa"
            raise ParameterError(
                f"Supply.pressure (p_s, gauge pressure of the supply) is {self.pressure / 1e3:.4g}"
                f" kPa, which is not above absolute vacuum; allowed range: above {vacuum} at an"
                f" ambient pressure of {ambient.pressure / 1e3:.4g} kPa. Give a higher pressure, or"
                " check the ambient pressure."
            )


@model
class SharedSupply(AirSource):
    """Placeholder for the supply of a branch in a `Manifold`, which feeds all its branches from one
    supply.
    """

    def air(self, state: Values, ambient: Ambient) -> Air:
        raise ParameterError(
            "SharedSupply() is a placeholder for the supply of a Manifold; it contains no air."
        )


def check_not_shared(owner: str, supply: AirSource) -> None:
    """Raise ParameterError for a SharedSupply() outside of a manifold."""
    if isinstance(supply, SharedSupply):
        raise ParameterError(
            f"{owner}: SharedSupply() is allowed only as the supply of a branch in a Manifold; give"
            " a Supply, a Tank or a RegulatedSupply."
        )


class SuppliedVolume(AirSource):
    """Supply with a volume of air that is fed from another supply."""

    supply: AirSource
    volume: float
    gas: Gas

    def check(self) -> None:
        check_not_shared(type(self).__name__, self.supply)

    def check_ambient(self, ambient: Ambient) -> None:
        """As the feeding supply."""
        self.supply.check_ambient(ambient)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return (
            *self.gas.states(self.volume, ambient),
            *add_prefix("supply.", self.supply.states(ambient)),
        )

    def air(self, state: Values, ambient: Ambient) -> Air:
        return self.gas.air(state, self.volume, ambient)

    def balance(
        self, state: Values, drawn: Flow, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        upstream = select_prefix("supply.", state)
        air = self.air(state, ambient)
        upstream_air = self.supply.air(upstream, ambient)
        feed_flow = self.feed_flow(upstream_air, air, ambient)
        upstream_rates, inflow = self.supply.balance(upstream, feed_flow, ambient)
        rates = self.gas.rates(state, air, feed_flow - drawn, 0.0, ambient)
        return {**rates, **with_prefix("supply.", upstream_rates)}, inflow

    @abc.abstractmethod
    def feed_flow(self, upstream: Air, air: Air, ambient: Ambient) -> Flow:
        """Flow into the volume, from the air of the feeding supply and of the volume."""


@model
class Tank(SuppliedVolume):
    """Tank: a volume fed through an orifice; its pressure falls while more air is drawn than fed.

    m' = q_feed - q_drawn; the pressure follows from the gas model. The initial pressure is that of
    the feeding supply. A feed with zero conductance isolates the tank.
    """

    supply: AirSource
    feed: Orifice
    volume: float = parameter("m3", "V_T", "volume of the tank", bounds=(1e-6, 1e2))
    gas: Gas = Isothermal()

    def steady_state(self, ambient: Ambient) -> dict[str, Value]:
        upstream = self.supply.steady_state(ambient)
        pressure = self.supply.air(upstream, ambient).pressure
        return {
            **self.gas.state_at(pressure, self.volume, ambient),
            **with_prefix("supply.", upstream),
        }

    def feed_flow(self, upstream: Air, air: Air, ambient: Ambient) -> Flow:
        return orifice_flow(self.feed, upstream, air)


@model
class RegulatedSupply(SuppliedVolume):
    """Pressure regulator (non-relieving): the opening is proportional to the control error of the
    outlet pressure.

        opening = clip((p_set - p)/B, 0, 1)

    p outlet pressure, p_set set pressure, B proportional band, the droop of the outlet pressure
    from zero to full flow. Air flows back through the regulator if the pressure of its supply falls
    below the outlet pressure. The initial outlet pressure is the smaller of the set pressure and
    the pressure of the supply.
    """

    supply: AirSource
    valve: Orifice
    pressure: float = parameter(
        "Pa", "p_set", "set gauge pressure", bounds=(0.0, 2e6), plausible=1e3
    )
    band: float = parameter(
        "Pa",
        "B",
        "proportional band: droop from zero to full flow",
        bounds=(100.0, 1e6),
        default=2e4,
    )
    volume: float = parameter("m3", "V_r", "outlet volume", bounds=(1e-7, 1.0), default=5e-5)
    gas: Gas = Isothermal()

    def steady_state(self, ambient: Ambient) -> dict[str, Value]:
        upstream = self.supply.steady_state(ambient)
        pressure = ops.minimum(
            absolute_pressure(self.pressure, ambient), self.supply.air(upstream, ambient).pressure
        )
        return {
            **self.gas.state_at(pressure, self.volume, ambient),
            **with_prefix("supply.", upstream),
        }

    def feed_flow(self, upstream: Air, air: Air, ambient: Ambient) -> Flow:
        opening = proportional_opening(
            absolute_pressure(self.pressure, ambient) - air.pressure, self.band
        )
        return orifice_flow(self.valve, upstream, air, opening)
