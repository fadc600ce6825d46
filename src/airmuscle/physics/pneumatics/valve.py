"""Valve flow after ISO 6358."""

from __future__ import annotations

from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from .gas import REFERENCE_DENSITY, REFERENCE_TEMPERATURE
from .orifice import Orifice

ISO6358 = Reference(
    "iso-6358",
    "ISO",
    "Pneumatic fluid power: determination of flow-rate characteristics of components using compressible fluids",
    "ISO 6358-1",
    2013,
    note="sonic conductance C, critical pressure ratio b; linear in the pressure difference near equal pressures",
)


@model
class Valve(Orifice):
    """Valve or orifice after ISO 6358, with sonic conductance C and critical pressure ratio b.

        qm = C rho0 p1 sqrt(T0/T1) phi,   phi = 1                                choked, p2/p1 <= b
                                          phi = sqrt(1 - ((p2/p1 - b)/(1 - b))^2)  subsonic
                                          phi = k (1 - p2/p1)                     laminar, p2/p1 > r

    p1 larger, p2 smaller absolute pressure; the sign of the flow is that of their difference. rho0, T0 reference
    atmosphere of ISO 8778. The laminar chord intersects the subsonic law at r and removes its infinite slope at equal
    pressures. Reference: ISO 6358-1; Hošovský et al., equations cited as (2) and (6).
    """

    references: ClassVar[tuple[Reference, ...]] = (ISO6358,)

    conductance: float = parameter("m3/(s Pa)", "C", "sonic conductance, fully open", bounds=(0.0, 1e-5))
    critical_ratio: float = parameter("1", "b", "critical pressure ratio", bounds=(0.0, 0.95))
    laminar_ratio: float = parameter(
        "1", "r", "pressure ratio above which the flow is laminar", bounds=(0.96, 0.99999), fitted=False, default=0.999
    )

    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        """Mass flow [kg/s] from absolute pressure `upstream` to `downstream` [Pa] of air at `temperature` [K].

        `opening` scales the conductance from 0 (closed) to 1 (fully open). A reversed flow is negative.
        """
        high, low = ops.maximum(upstream, downstream), ops.minimum(upstream, downstream)
        subsonic = ops.maximum(low - self.critical_ratio * high, 0.0) / (1.0 - self.critical_ratio)
        # Both branches are concave in the pressure difference, so the smaller one is the chord near equal pressures
        # and the ellipse elsewhere. The lower bound of the square root (1 Pa) keeps its derivative finite.
        ellipse = ops.sqrt(ops.maximum(high**2 - subsonic**2, 1.0))
        chord = self.laminar_slope() * (high - low)
        flow = ops.minimum(ellipse, chord)
        scale = self.conductance * REFERENCE_DENSITY * ops.sqrt(REFERENCE_TEMPERATURE / temperature)
        return opening * scale * ops.where(upstream >= downstream, flow, -flow)

    def laminar_slope(self) -> Value:
        """Slope k of the laminar chord."""
        subsonic = (self.laminar_ratio - self.critical_ratio) / (1.0 - self.critical_ratio)
        return ops.sqrt(1.0 - subsonic**2) / (1.0 - self.laminar_ratio)
