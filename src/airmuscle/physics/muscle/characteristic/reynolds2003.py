"""Reynolds 2003: contractile force, spring stiffness and damping, linear in pressure."""

from typing import ClassVar, Self

from ....core import Reference, Value, model, ops, parameter, published
from ..geometry.base import LENGTHS, RESTING_LENGTH
from ..passive_elements import Damper, Spring
from .base import ForceLaw
from .data_scales import DataScales, MeasuredPoints

REYNOLDS_2003 = published("reynolds-2003")


@model
class Reynolds2003(ForceLaw):
    """Contractile force and parallel spring: F = f_0 + f_1 p - (k_0 + k_1 p) L_0 eps.

    p: gauge pressure; eps: contraction; f: contractile force; k: stiffness of the parallel spring,
    given in N/mm for one specimen, so that its resting length L_0 is required. Reference: Reynolds
    et al. (2003).
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    force_offset: float = parameter("N", "f_0", "contractile force at zero pressure", default=179.2)
    force_by_pressure: float = parameter(
        "N/Pa", "f_1", "increase of the contractile force with pressure", default=1.39e-3
    )
    stiffness_offset: float = parameter("N/m", "k_0", "stiffness at zero pressure", default=5.71e3)
    stiffness_by_pressure: float = parameter(
        "N/m/Pa", "k_1", "increase of the stiffness with pressure", default=0.0307
    )

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        return cls(DataScales.of(data).resting_length)

    def force(self, pressure: Value, contraction: Value) -> Value:
        contractile = self.force_offset + self.force_by_pressure * pressure
        stiffness = self.stiffness_offset + self.stiffness_by_pressure * pressure
        return contractile - stiffness * self.resting_length * contraction


@model
class Reynolds2003Spring(Spring):
    """Spring F_PP = max(k_0 + k_1 p, 0) L_0 eps: a stiffness linear in gauge pressure p, never
    negative.

    Identified from 207 to 621 kPa. The characteristic `Reynolds2003` already contains this spring;
    use it only with another contractile element. Reference: Reynolds et al. (2003), from a
    secondary source.
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    stiffness: float = parameter(
        "N/m", "k_0", "stiffness at zero gauge pressure", bounds=(0.0, 1e7), default=5.71e3
    )
    stiffness_slope: float = parameter(
        "N/m/Pa",
        "k_1",
        "slope of the stiffness over pressure",
        bounds=(-10.0, 10.0),
        default=0.0307,
    )

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return (
            ops.maximum(self.stiffness + self.stiffness_slope * pressure, 0.0)
            * resting_length
            * contraction
        )


@model
class Reynolds2003Damper(Damper):
    """Damper F_TL = B v with B = max(b_c0 + b_c1 p, 0) during shortening and max(b_r0 + b_r1 p, 0)
    during lengthening.

    p gauge pressure. Identified from 207 to 621 kPa; the damping is smaller during lengthening.
    Reference: Reynolds et al. (2003), from a secondary source, as are the coefficients of the
    characteristic.
    """

    references: ClassVar[tuple[Reference, ...]] = (REYNOLDS_2003,)

    shortening: float = parameter(
        "N s/m",
        "b_c0",
        "shortening coefficient at zero gauge pressure",
        bounds=(0.0, 1e6),
        default=1.01e3,
    )
    shortening_slope: float = parameter(
        "N s/(m Pa)",
        "b_c1",
        "slope of the shortening coefficient over pressure",
        bounds=(-1.0, 1.0),
        default=6.91e-3,
    )
    lengthening: float = parameter(
        "N s/m",
        "b_r0",
        "lengthening coefficient at zero gauge pressure",
        bounds=(0.0, 1e6),
        default=600.0,
    )
    lengthening_slope: float = parameter(
        "N s/(m Pa)",
        "b_r1",
        "slope of the lengthening coefficient over pressure",
        bounds=(-1.0, 1.0),
        default=-8.03e-4,
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        shortening = self.shortening + self.shortening_slope * pressure
        lengthening = self.lengthening + self.lengthening_slope * pressure
        return ops.maximum(shortening, 0.0), ops.maximum(lengthening, 0.0)
