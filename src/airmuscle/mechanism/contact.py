"""Contact of two bodies, after Hunt and Crossley: continuous where it begins and where it ends."""

from __future__ import annotations

from typing import ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference

HUNT_CROSSLEY1975 = Reference(
    key="hunt-crossley-1975",
    authors="Hunt, K. H., Crossley, F. R. E.",
    title="Coefficient of restitution interpreted as damping in vibroimpact",
    where="Journal of Applied Mechanics 42(2), 440-445",
    year=1975,
    doi="10.1115/1.3423596",
    note="force of a contact whose damping grows with the depth",
)


@model
class HuntCrossley:
    """F = K delta^(3/2) (1 + c delta'), never pulling.

    delta depth of the contact [m], K stiffness, c damping: the force begins and ends at zero without a jump, and a
    slow impact at a speed v ends with (1 - 2/3 c v) of it (for c v = 0.1 that is 0.933, and exactly 0.938).
    Reference: Hunt and Crossley (1975); the exponent is that of Hertz.
    """

    references: ClassVar[tuple[Reference, ...]] = (HUNT_CROSSLEY1975,)

    stiffness: float = parameter("N/m^1.5", "K", "stiffness of the contact", bounds=(1.0, 1e12))
    damping: float = parameter("s/m", "c", "damping of the contact", bounds=(0.0, 100.0), default=0.5)

    def force(self, depth: Value, speed: Value) -> Value:
        """Force [N] at a depth [m], 0 where there is no contact, that grows at a speed [m/s]."""
        return self.elastic(depth) * ops.maximum(1.0 + self.damping * speed, 0.0)

    def elastic(self, depth: Value) -> Value:
        """Force [N] at a depth [m] that does not change; times c it is the coefficient of the damping [N s/m]."""
        return self.stiffness * depth * _root(depth)

    def energy(self, depth: Value) -> Value:
        """Energy [J] that it holds elastically at a depth [m]: (2/5) K delta^(5/2)."""
        return 0.4 * self.stiffness * depth**2 * _root(depth)


def _root(depth: Value) -> Value:
    """Square root whose slope stays finite at zero, where the depth before it makes the product vanish."""
    return ops.sqrt(ops.maximum(depth, 1e-30))
