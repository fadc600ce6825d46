"""Serres 2009: Reynolds model of a Festo muscle, with two pressure ranges of the spring stiffness."""

from __future__ import annotations

from typing import ClassVar

from ....core import ops
from ....core.declaration import model, parameter
from ....core.ops import Value
from ....core.reference import Reference
from .base import ForceLaw

SERRES_2009 = Reference(
    "serres-2009",
    "Serres, J. L., Reynolds, D. B., Phillips, C. A., Gerschutz, M. J., Repperger, D. W.",
    "Characterisation of a phenomenological model for commercial pneumatic muscle actuators",
    "Computer Methods in Biomechanics and Biomedical Engineering 12(4):423-430",
    2009,
    note="coefficients as printed in the abstract",
)


@model
class Serres2009(ForceLaw):
    """Contractile force and parallel spring: F = f_0 + f_1 p - K(p) L_0 eps,   K = max(k_0 - k_1 p, k_2 + k_3 p).

    p: gauge pressure; eps: contraction; f: contractile force; K: spring stiffness, which decreases up to 314 kPa, where
    its two printed lines intersect, and increases above. It is given in N/mm for one specimen, so that its resting
    length L_0 is required. Reference: Serres et al. (2009).
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    force_offset: float = parameter("N", "f_0", "contractile force at zero pressure", default=44.6)
    force_by_pressure: float = parameter(
        "N/Pa", "f_1", "increase of the contractile force with pressure", default=2.91e-3
    )
    softening_offset: float = parameter("N/m", "k_0", "softening line: stiffness at zero pressure", default=32.7e3)
    softening: float = parameter(
        "N/m/Pa", "k_1", "softening line: decrease with pressure", bounds=(0.0, 1e3), default=0.0321
    )
    stiffening_offset: float = parameter("N/m", "k_2", "stiffening line: stiffness at zero pressure", default=17e3)
    stiffening: float = parameter(
        "N/m/Pa", "k_3", "stiffening line: increase with pressure", bounds=(0.0, 1e3), default=0.0179
    )

    def force(self, pressure: Value, contraction: Value) -> Value:
        contractile = self.force_offset + self.force_by_pressure * pressure
        softening = self.softening_offset - self.softening * pressure
        stiffening = self.stiffening_offset + self.stiffening * pressure
        return contractile - ops.maximum(softening, stiffening) * self.resting_length * contraction
