"""Reynolds2003Spring and Reynolds2003Damper: parallel elements for use with another contractile element."""

from __future__ import annotations

from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from .characteristic.reynolds2003 import REYNOLDS_2003
from .damper import Damper
from .spring import Spring


@model
class Reynolds2003Spring(Spring):
    """Spring F_PP = max(k_0 + k_1 p, 0) L_0 eps: a stiffness linear in gauge pressure p, never negative.

    Identified from 207 to 621 kPa. The characteristic `Reynolds2003` already contains this spring; use it only with
    another contractile element. Reference: Reynolds et al. (2003), from a secondary source.
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    stiffness: float = parameter("N/m", "k_0", "stiffness at zero gauge pressure", bounds=(0.0, 1e7), default=5.71e3)
    stiffness_slope: float = parameter(
        "N/m/Pa", "k_1", "slope of the stiffness over pressure", bounds=(-10.0, 10.0), default=0.0307
    )

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return ops.maximum(self.stiffness + self.stiffness_slope * pressure, 0.0) * resting_length * contraction


@model
class Reynolds2003Damper(Damper):
    """Damper F_TL = B v with B = max(b_c0 + b_c1 p, 0) during shortening and max(b_r0 + b_r1 p, 0) during lengthening.

    p gauge pressure. Identified from 207 to 621 kPa; the damping is smaller during lengthening. Reference: Reynolds et
    al. (2003), from a secondary source, as are the coefficients of the characteristic.
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    shortening: float = parameter(
        "N s/m", "b_c0", "shortening coefficient at zero gauge pressure", bounds=(0.0, 1e6), default=1.01e3
    )
    shortening_slope: float = parameter(
        "N s/(m Pa)", "b_c1", "slope of the shortening coefficient over pressure", bounds=(-1.0, 1.0), default=6.91e-3
    )
    lengthening: float = parameter(
        "N s/m", "b_r0", "lengthening coefficient at zero gauge pressure", bounds=(0.0, 1e6), default=600.0
    )
    lengthening_slope: float = parameter(
        "N s/(m Pa)", "b_r1", "slope of the lengthening coefficient over pressure", bounds=(-1.0, 1.0), default=-8.03e-4
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        shortening = self.shortening + self.shortening_slope * pressure
        lengthening = self.lengthening + self.lengthening_slope * pressure
        return ops.maximum(shortening, 0.0), ops.maximum(lengthening, 0.0)
