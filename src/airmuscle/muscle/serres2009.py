"""Spring and damper of Serres 2009, beside a contractile element of one's own."""

from __future__ import annotations

from typing import ClassVar

from ..characteristic.serres2009 import SERRES_2009
from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from .damper import Damper
from .spring import Spring


@model
class Serres2009Spring(Spring):
    """F_PP = max(k_0 - k_1 p, k_2 + k_3 p) L_0 eps: softer up to 314 kPa of gauge pressure p, stiffer beyond.

    Found from 150 to 550 kPa on one Festo muscle. The characteristic `Serres2009` contains it already; this one stands
    beside another contractile element. Reference: Serres et al. (2009), abstract.
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    softening_offset: float = parameter(
        "N/m", "k_0", "stiffness of the softening line at no pressure", bounds=(0.0, 1e7), default=32.7e3
    )
    softening: float = parameter("N/m/Pa", "k_1", "loss of stiffness with pressure", bounds=(0.0, 10.0), default=0.0321)
    stiffening_offset: float = parameter(
        "N/m", "k_2", "stiffness of the stiffening line at no pressure", bounds=(0.0, 1e7), default=17e3
    )
    stiffening: float = parameter(
        "N/m/Pa", "k_3", "gain of stiffness with pressure", bounds=(0.0, 10.0), default=0.0179
    )

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        softening = self.softening_offset - self.softening * pressure
        stiffening = self.stiffening_offset + self.stiffening * pressure
        return ops.maximum(ops.maximum(softening, stiffening), 0.0) * resting_length * contraction


@model
class Serres2009Damper(Damper):
    """F_TL = B v,  B = b_c while it shortens, max(b_r, b_0 + b_1 p) while it lengthens.

    p gauge pressure. Found from 150 to 550 kPa: while it lengthens, constant up to 372 kPa, where the printed lines
    meet, and rising beyond. Reference: Serres et al. (2009), abstract.
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    shortening: float = parameter("N s/m", "b_c", "coefficient of shortening", bounds=(0.0, 1e6), default=2.90e3)
    lengthening: float = parameter(
        "N s/m", "b_r", "coefficient of lengthening at low pressure", bounds=(0.0, 1e6), default=1.57e3
    )
    rising_offset: float = parameter(
        "N s/m", "b_0", "rising line of lengthening at no pressure", bounds=(-1e6, 1e6), default=311.0
    )
    rising: float = parameter(
        "N s/(m Pa)", "b_1", "growth of that line with pressure", bounds=(0.0, 1.0), default=3.38e-3
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        return self.shortening, ops.maximum(self.lengthening, self.rising_offset + self.rising * pressure)
