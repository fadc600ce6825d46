"""Serres 2009: Reynolds model of a Festo muscle, with two pressure ranges of the spring stiffness;
its damper.
"""

from typing import ClassVar, Self

from ....core import Reference, Value, model, ops, parameter, published
from ..geometry.base import LENGTHS, RESTING_LENGTH
from ..passive_elements import Damper, Spring
from .base import ForceLaw
from .data_scales import DataScales, MeasuredPoints

SERRES_2009 = published("serres-2009")


@model
class Serres2009(ForceLaw):
    """Contractile force and parallel spring: F = f_0 + f_1 p - K(p) L_0 eps,   K = max(k_0 - k_1 p,
    k_2 + k_3 p).

    p: gauge pressure; eps: contraction; f: contractile force; K: spring stiffness, which decreases
    up to 314 kPa, where its two printed lines intersect, and increases above. It is given in N/mm
    for one specimen, so that its resting length L_0 is required. Reference: Serres et al. (2009).
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    force_offset: float = parameter("N", "f_0", "contractile force at zero pressure", default=44.6)
    force_by_pressure: float = parameter(
        "N/Pa", "f_1", "increase of the contractile force with pressure", default=2.91e-3
    )
    softening_offset: float = parameter(
        "N/m", "k_0", "softening line: stiffness at zero pressure", default=32.7e3
    )
    softening: float = parameter(
        "N/m/Pa", "k_1", "softening line: decrease with pressure", bounds=(0.0, 1e3), default=0.0321
    )
    stiffening_offset: float = parameter(
        "N/m", "k_2", "stiffening line: stiffness at zero pressure", default=17e3
    )
    stiffening: float = parameter(
        "N/m/Pa",
        "k_3",
        "stiffening line: increase with pressure",
        bounds=(0.0, 1e3),
        default=0.0179,
    )

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        return cls(DataScales.of(data).resting_length)

    def force(self, pressure: Value, contraction: Value) -> Value:
        contractile = self.force_offset + self.force_by_pressure * pressure
        softening = self.softening_offset - self.softening * pressure
        stiffening = self.stiffening_offset + self.stiffening * pressure
        return contractile - ops.maximum(softening, stiffening) * self.resting_length * contraction


@model
class Serres2009Spring(Spring):
    """Spring F_PP = max(k_0 - k_1 p, k_2 + k_3 p, 0) L_0 eps; the stiffness has its minimum at p =
    314 kPa gauge.

    Identified from 150 to 550 kPa on one Festo muscle. The characteristic `Serres2009` already
    contains this spring; use it only with another contractile element. Reference: Serres et al.
    (2009), abstract.
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    softening_offset: float = parameter(
        "N/m", "k_0", "softening line at zero gauge pressure", bounds=(0.0, 1e7), default=32.7e3
    )
    softening: float = parameter(
        "N/m/Pa", "k_1", "decrease of stiffness with pressure", bounds=(0.0, 10.0), default=0.0321
    )
    stiffening_offset: float = parameter(
        "N/m", "k_2", "stiffening line at zero gauge pressure", bounds=(0.0, 1e7), default=17e3
    )
    stiffening: float = parameter(
        "N/m/Pa", "k_3", "increase of stiffness with pressure", bounds=(0.0, 10.0), default=0.0179
    )

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        softening = self.softening_offset - self.softening * pressure
        stiffening = self.stiffening_offset + self.stiffening * pressure
        return ops.maximum(ops.maximum(softening, stiffening), 0.0) * resting_length * contraction


@model
class Serres2009Damper(Damper):
    """Damper F_TL = B v with B = b_c during shortening and max(b_r, b_0 + b_1 p) during
    lengthening.

    p gauge pressure. Identified from 150 to 550 kPa. During lengthening the coefficient is constant
    up to 372 kPa, where the two printed lines intersect, and increases above. Reference: Serres et
    al. (2009), abstract.
    """

    references: ClassVar[tuple[Reference, ...]] = (SERRES_2009,)

    shortening: float = parameter(
        "N s/m", "b_c", "shortening coefficient", bounds=(0.0, 1e6), default=2.90e3
    )
    lengthening: float = parameter(
        "N s/m", "b_r", "lengthening coefficient at low pressure", bounds=(0.0, 1e6), default=1.57e3
    )
    rising_offset: float = parameter(
        "N s/m",
        "b_0",
        "rising line for lengthening at zero gauge pressure",
        bounds=(-1e6, 1e6),
        default=311.0,
    )
    rising_slope: float = parameter(
        "N s/(m Pa)",
        "b_1",
        "slope of the rising line over pressure",
        bounds=(0.0, 1.0),
        default=3.38e-3,
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        return self.shortening, ops.maximum(
            self.lengthening, self.rising_offset + self.rising_slope * pressure
        )
