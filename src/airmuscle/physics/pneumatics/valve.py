"""Valves and orifices: flow after ISO 6358, check valve, flow between two volumes."""

import abc
from typing import ClassVar

from ...core import Reference, Value, model, ops, parameter, published
from .gas import REFERENCE_DENSITY, REFERENCE_TEMPERATURE, Air, Flow, upstream_temperature


class Orifice(abc.ABC):
    """Flow restriction between two pressures: valve, silencer, leak or port (interface).

    Flow laws are continuous, give no flow at equal pressures, and never a flow towards the higher
    pressure.
    """

    @abc.abstractmethod
    def mass_flow(
        self, upstream: Value, downstream: Value, opening: Value, temperature: Value
    ) -> Value:
        """Mass flow [kg/s] from absolute pressure `upstream` to `downstream` [Pa] of air at
        `temperature` [K].

        `opening` scales the conductance from 0 (closed) to 1 (fully open). A reversed flow is
        negative.
        """


ISO6358 = published("iso-6358")


@model
class Valve(Orifice):
    """Valve or orifice after ISO 6358, with sonic conductance C and critical pressure ratio b.

        qm = C rho0 p1 sqrt(T0/T1) phi,   phi = 1                                choked, p2/p1 <= b
                                          phi = sqrt(1 - ((p2/p1 - b)/(1 - b))^2)  subsonic
                                          phi = k (1 - p2/p1)                     laminar, p2/p1 > r

    p1 larger, p2 smaller absolute pressure; the sign of the flow is that of their difference. rho0,
    T0 reference atmosphere of ISO 8778. The laminar chord intersects the subsonic law at r and
    removes its infinite slope at equal pressures. Reference: ISO 6358-1; Hošovský et al., equations
    cited as (2) and (6).
    """

    references: ClassVar[tuple[Reference, ...]] = (ISO6358,)

    conductance: float = parameter(
        "m3/(s Pa)", "C", "sonic conductance, fully open", bounds=(0.0, 1e-5)
    )
    critical_ratio: float = parameter("1", "b", "critical pressure ratio", bounds=(0.0, 0.95))
    laminar_ratio: float = parameter(
        "1",
        "r",
        "pressure ratio above which the flow is laminar",
        bounds=(0.96, 0.99999),
        fitted=False,
        default=0.999,
    )

    def mass_flow(
        self, upstream: Value, downstream: Value, opening: Value, temperature: Value
    ) -> Value:
        high = ops.maximum(upstream, downstream)
        low = ops.minimum(upstream, downstream)
        subsonic = ops.maximum(low - self.critical_ratio * high, 0.0) / (1.0 - self.critical_ratio)
        # Both branches are concave in the pressure difference, so the smaller one is the chord near
        # equal pressures and the ellipse elsewhere. The lower bound of the square root (1 Pa) keeps
        # its derivative finite.
        ellipse = ops.sqrt(ops.maximum(high**2 - subsonic**2, 1.0))
        chord = self.laminar_slope() * (high - low)
        flow = ops.minimum(ellipse, chord)
        scale = self.conductance * REFERENCE_DENSITY * ops.sqrt(REFERENCE_TEMPERATURE / temperature)
        return opening * scale * ops.where(upstream >= downstream, flow, -flow)

    def laminar_slope(self) -> Value:
        """Slope k of the laminar chord."""
        subsonic = (self.laminar_ratio - self.critical_ratio) / (1.0 - self.critical_ratio)
        return ops.sqrt(1.0 - subsonic**2) / (1.0 - self.laminar_ratio)


_MIN_BASE = 1e-9
"""Lower bound of the base of the power, which keeps its derivative finite where the chord
applies.
"""


@model
class SubsonicIndexValve(Orifice):
    """Valve with sonic conductance C, critical pressure ratio b, subsonic index m and cracking
    pressure dp_c.

        qm = C rho0 p1 sqrt(T0/T1) phi
        phi = 1                                                       choked, p2/p1 <= b
        phi = (1 - ((p2/p1 - b)/(1 - b - dp_c/p1))^2)^m               subsonic
        phi = k (p1 - p2 - dp_c)/p1                                   within (1 - r) p1 above the
            cracking pressure
        phi = 0                                                       closed, p1 - p2 <= dp_c

    p1 larger, p2 smaller absolute pressure; the sign of the flow is that of their difference. The
    cracking pressure applies in both directions (for one direction only, use CheckValve around this
    valve). With m = 0.5 and dp_c = 0 the law is that of Valve. Where the cracking pressure covers
    the whole subsonic range, 1 - b - dp_c/p1 < 1 - r, the formula of the standard is discontinuous;
    here the flow then increases to the choked flow within (1 - r) p1. m is limited to 1, above
    which the laminar chord would lie above the curve. Reference: ISO 6358-1:2013, from a secondary
    source.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("iso-6358-1-2013"),)

    conductance: float = parameter(
        "m3/(s Pa)", "C", "sonic conductance, fully open", bounds=(0.0, 1e-5)
    )
    critical_ratio: float = parameter("1", "b", "critical pressure ratio", bounds=(0.0, 0.95))
    subsonic_index: float = parameter("1", "m", "subsonic index", bounds=(0.25, 1.0), default=0.5)
    cracking_pressure: float = parameter(
        "Pa",
        "dp_c",
        "pressure difference at which the valve begins to open",
        bounds=(0.0, 5e5),
        default=0.0,
    )
    laminar_ratio: float = parameter(
        "1",
        "r",
        "pressure ratio above which the flow is laminar",
        bounds=(0.96, 0.99999),
        fitted=False,
        default=0.999,
    )

    def mass_flow(
        self, upstream: Value, downstream: Value, opening: Value, temperature: Value
    ) -> Value:
        high = ops.maximum(upstream, downstream)
        low = ops.minimum(upstream, downstream)
        chord_range = (1.0 - self.laminar_ratio) * high
        subsonic_range = ops.maximum(
            (1.0 - self.critical_ratio) * high - self.cracking_pressure, chord_range
        )
        # Normalised pressure difference from cracking (0) to choking (1); the bracket of the
        # standard is 1 minus this.
        difference = ops.clip((high - low - self.cracking_pressure) / subsonic_range, 0.0, 1.0)
        laminar_end = chord_range / subsonic_range
        chord = self._fraction(laminar_end) * (difference / laminar_end)
        flow = high * ops.minimum(self._fraction(difference), chord)
        scale = self.conductance * REFERENCE_DENSITY * ops.sqrt(REFERENCE_TEMPERATURE / temperature)
        return opening * scale * ops.where(upstream >= downstream, flow, -flow)

    def _fraction(self, difference: Value) -> Value:
        """Fraction of the choked flow, (1 - (1 - difference)^2)^m."""
        return ops.maximum(difference * (2.0 - difference), _MIN_BASE) ** self.subsonic_index


@model
class CheckValve(Orifice):
    """Check valve around any orifice: qm = max(0, qm of the orifice).

    A cracking pressure belongs to the orifice: `CheckValve(SubsonicIndexValve(C, b,
    cracking_pressure=20 * kPa))`. The flow is continuous, because it is zero at the reversal.
    Inertia and friction of the closing body are neglected.
    """

    orifice: Orifice

    def mass_flow(
        self, upstream: Value, downstream: Value, opening: Value, temperature: Value
    ) -> Value:
        return ops.maximum(self.orifice.mass_flow(upstream, downstream, opening, temperature), 0.0)


def orifice_flow(orifice: Orifice, first: Air, second: Air, opening: Value = 1.0) -> Flow:
    """Mass flow [kg/s] and enthalpy flow [W] from `first` to `second`, with the temperature of the
    upstream side.
    """
    temperature = upstream_temperature(first, second, first.pressure >= second.pressure)
    return Flow.at(
        temperature, orifice.mass_flow(first.pressure, second.pressure, opening, temperature)
    )


def proportional_opening(error: Value, band: Value) -> Value:
    """Opening from 0 to 1, proportional to an error from 0 to `band` and saturated outside."""
    return ops.clip(error / band, 0.0, 1.0)
