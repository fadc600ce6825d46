"""Hunt-Crossley contact: a contact force that is continuous at the beginning and the end of contact."""

from __future__ import annotations

from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference

HUNT_CROSSLEY1975 = Reference(
    key="hunt-crossley-1975",
    authors="Hunt, K. H., Crossley, F. R. E.",
    title="Coefficient of restitution interpreted as damping in vibroimpact",
    where="Journal of Applied Mechanics 42(2), 440-445",
    year=1975,
    doi="10.1115/1.3423596",
    note="contact force with a damping proportional to the elastic force",
)


@model
class HuntCrossley:
    """Hunt-Crossley contact: F = K delta^(3/2) max(1 + c delta', 0).

    delta contact depth [m], K stiffness, c damping. The force is zero and continuous at the beginning and the end of
    contact and never pulls. For a slow impact at a speed v, the coefficient of restitution is about 1 - 2/3 c v (0.933
    for c v = 0.1; the exact value is 0.938).
    Reference: Hunt and Crossley (1975), with the exponent of Hertz.
    """

    references: ClassVar[tuple[Reference, ...]] = (HUNT_CROSSLEY1975,)

    stiffness: float = parameter("N/m^1.5", "K", "stiffness of the contact", bounds=(1.0, 1e12))
    damping: float = parameter("s/m", "c", "damping of the contact", bounds=(0.0, 100.0), default=0.5)

    def force(self, depth: Value, speed: Value) -> Value:
        """Contact force [N] at a depth [m], 0 without contact, that increases at a speed [m/s]."""
        return self.elastic_force(depth) * ops.maximum(1.0 + self.damping * speed, 0.0)

    def elastic_force(self, depth: Value) -> Value:
        """Elastic part of the contact force [N] at a depth [m]; times c it is the damping coefficient [N s/m]."""
        return self.stiffness * depth * _regularised_sqrt(depth)

    def elastic_energy(self, depth: Value) -> Value:
        """Elastic energy [J] at a depth [m]: (2/5) K delta^(5/2)."""
        return 0.4 * self.stiffness * depth**2 * _regularised_sqrt(depth)


def _regularised_sqrt(depth: Value) -> Value:
    """Square root with a finite derivative at zero, where the factor depth makes the product zero."""
    return ops.sqrt(ops.maximum(depth, 1e-30))
