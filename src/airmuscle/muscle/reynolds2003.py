"""Spring and damper of Reynolds 2003, beside a contractile element of one's own."""

from __future__ import annotations

from typing import ClassVar

from ..characteristic.reynolds2003 import REYNOLDS_2003
from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from .damper import Damper
from .spring import Spring


@model
class Reynolds2003Spring(Spring):
    """F_PP = (k_0 + k_1 p) L_0 eps: a stiffness that grows with gauge pressure p, whose sum is never negative.

    Found from 207 to 621 kPa. The characteristic `Reynolds2003` contains it already; this one stands beside another
    contractile element. Reference: Reynolds et al. (2003), second hand.
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    stiffness: float = parameter("N/m", "k_0", "stiffness without pressure", bounds=(0.0, 1e7), default=5.71e3)
    growth: float = parameter("N/m/Pa", "k_1", "its growth with pressure", bounds=(-10.0, 10.0), default=0.0307)

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return ops.maximum(self.stiffness + self.growth * pressure, 0.0) * resting_length * contraction


@model
class Reynolds2003Damper(Damper):
    """F_TL = B v,  B = b_c0 + b_c1 p while it shortens, b_r0 + b_r1 p while it lengthens; neither is ever negative.

    p gauge pressure. Found from 207 to 621 kPa; a muscle damps less as it lengthens. Reference: Reynolds et al. (2003),
    second hand as the coefficients of the characteristic.
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    shortening: float = parameter("N s/m", "b_c0", "shortening, without pressure", bounds=(0.0, 1e6), default=1.01e3)
    shortening_growth: float = parameter(
        "N s/(m Pa)", "b_c1", "its growth with pressure", bounds=(-1.0, 1.0), default=6.91e-3
    )
    lengthening: float = parameter("N s/m", "b_r0", "lengthening, without pressure", bounds=(0.0, 1e6), default=600.0)
    lengthening_growth: float = parameter(
        "N s/(m Pa)", "b_r1", "its growth with pressure", bounds=(-1.0, 1.0), default=-8.03e-4
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        shortening = self.shortening + self.shortening_growth * pressure
        lengthening = self.lengthening + self.lengthening_growth * pressure
        return ops.maximum(shortening, 0.0), ops.maximum(lengthening, 0.0)
