"""Check valve: an orifice that passes flow in one direction only."""

from __future__ import annotations

from ...core import ops
from ...core.declaration import model
from ...core.ops import Value
from .orifice import Orifice


@model
class CheckValve(Orifice):
    """Check valve around any orifice: qm = max(0, qm of the orifice).

    A cracking pressure belongs to the orifice: `CheckValve(SubsonicIndexValve(C, b, cracking_pressure=20 * kPa))`. The
    flow is continuous, because it is zero at the reversal. Inertia and friction of the closing body are neglected.
    """

    orifice: Orifice

    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        return ops.maximum(self.orifice.mass_flow(upstream, downstream, opening, temperature), 0.0)
