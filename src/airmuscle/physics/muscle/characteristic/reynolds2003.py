"""Reynolds 2003: contractile force and spring stiffness, both linear in pressure."""

from __future__ import annotations

from typing import ClassVar

from ....core.declaration import model, parameter
from ....core.ops import Value
from ....core.reference import Reference
from .base import ForceLaw

REYNOLDS_2003 = Reference(
    "reynolds-2003",
    "Reynolds, D. B., Repperger, D. W., Phillips, C. A., Bandry, G.",
    "Modeling the dynamic characteristics of pneumatic muscle",
    "Annals of Biomedical Engineering 31(3):310-317",
    2003,
    "10.1114/1.1554921",
    "coefficients from a secondary source, Lilly and Quesada, IEEE TNSRE 12(3):349 (2004); units of N/mm inferred",
)


@model
class Reynolds2003(ForceLaw):
    """Contractile force and parallel spring: F = f_0 + f_1 p - (k_0 + k_1 p) L_0 eps.

    p: gauge pressure; eps: contraction; f: contractile force; k: stiffness of the parallel spring, given in N/mm for
    one specimen, so that its resting length L_0 is required. Reference: Reynolds et al. (2003).
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    force_offset: float = parameter("N", "f_0", "contractile force at zero pressure", default=179.2)
    force_by_pressure: float = parameter(
        "N/Pa", "f_1", "increase of the contractile force with pressure", default=1.39e-3
    )
    stiffness_offset: float = parameter("N/m", "k_0", "stiffness at zero pressure", default=5.71e3)
    stiffness_by_pressure: float = parameter("N/m/Pa", "k_1", "increase of the stiffness with pressure", default=0.0307)

    def force(self, pressure: Value, contraction: Value) -> Value:
        contractile = self.force_offset + self.force_by_pressure * pressure
        stiffness = self.stiffness_offset + self.stiffness_by_pressure * pressure
        return contractile - stiffness * self.resting_length * contraction
