"""A valve that lets air through one way only."""

from __future__ import annotations

from ..core import ops
from ..core.declaration import model
from ..core.ops import Value
from .orifice import Orifice


@model
class CheckValve(Orifice):
    """Any orifice, closed against the flow back:  qm = max(0, qm of the orifice).

    Its cracking pressure is the orifice's: `CheckValve(IndexedValve(C, b, cracking_pressure=20 * kPa))`. The flow is
    continuous, as it is zero where the direction turns. The mass and the sticking of the closing body are not in it.
    """

    orifice: Orifice

    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        return ops.maximum(self.orifice.mass_flow(upstream, downstream, opening, temperature), 0.0)
