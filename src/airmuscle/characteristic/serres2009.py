"""Serres 2009: Reynolds' elements identified on a Festo muscle, the spring with two ranges of pressure."""

from __future__ import annotations

from typing import ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from .base import ForceLaw

SERRES_2009 = Reference(
    "serres-2009",
    "Serres, J. L., Reynolds, D. B., Phillips, C. A., Gerschutz, M. J., Repperger, D. W.",
    "Characterisation of a phenomenological model for commercial pneumatic muscle actuators",
    "Computer Methods in Biomechanics and Biomedical Engineering 12(4):423-430",
    2009,
    note="coefficients as the abstract prints them",
)


@model
class Serres2009(ForceLaw):
    """F = f_0 + f_1 p - K(p) L_0 eps,   K = max(k_0 - k_1 p, k_2 + k_3 p).

    p gauge pressure, eps contraction; f the contractile force. The spring softens up to 314 kPa and stiffens beyond,
    where its two printed lines cross. It is in N/mm of one specimen: so the law needs that specimen's resting
    length L_0. Reference: Serres et al. (2009).
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    force_offset: float = parameter("N", "f_0", "contractile force without pressure", default=44.6)
    force_by_pressure: float = parameter("N/Pa", "f_1", "growth of the contractile force", default=2.91e-3)
    softening_offset: float = parameter("N/m", "k_0", "stiffness of the softening line at no pressure", default=32.7e3)
    softening: float = parameter("N/m/Pa", "k_1", "loss of stiffness with pressure", bounds=(0.0, 1e3), default=0.0321)
    stiffening_offset: float = parameter("N/m", "k_2", "stiffness of the stiffening line at no pressure", default=17e3)
    stiffening: float = parameter("N/m/Pa", "k_3", "gain of stiffness with pressure", bounds=(0.0, 1e3), default=0.0179)

    def force(self, pressure: Value, contraction: Value) -> Value:
        contractile = self.force_offset + self.force_by_pressure * pressure
        softening = self.softening_offset - self.softening * pressure
        stiffening = self.stiffening_offset + self.stiffening * pressure
        return contractile - ops.maximum(softening, stiffening) * self.resting_length * contraction
