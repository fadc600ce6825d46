"""Sárosi 2012: force of a fluidic muscle with six coefficients."""

from typing import ClassVar, Self

from ....core import Reference, Value, model, ops, parameter, published
from .base import ForceLaw
from .data_scales import DataScales, MeasuredPoints


@model
class Sarosi2012(ForceLaw):
    """Sárosi's model: F = (a_1 p + a_2) exp(a_3 eps) + a_4 eps p + a_5 p + a_6.

    p: gauge pressure; eps: contraction. The papers print the coefficients for p in bar and eps in
    per cent; a library file contains them with these units (`"-0.342 1/%"`), which are converted on
    reading. The model was fitted to positive forces; at low pressure it becomes negative, so that
    it is used inside `Clamped`.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("sarosi-2012"),)
    linear_in: ClassVar[tuple[str, ...]] = ("a1", "a2", "a4", "a5", "a6")

    a1: float = parameter("N/Pa", "a_1", "exponential term: increase with pressure")
    a2: float = parameter("N", "a_2", "exponential term: value at zero pressure")
    a3: float = parameter(
        "1", "a_3", "exponential term: decay with contraction", bounds=(-1e3, 0.0)
    )
    a4: float = parameter("N/Pa", "a_4", "increase with the product of contraction and pressure")
    a5: float = parameter("N/Pa", "a_5", "increase with pressure")
    a6: float = parameter("N", "a_6", "force at zero pressure and large contraction")

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        scales = DataScales.of(data).check_positive("pressure")
        factor = scales.force / 1500.0  # relative to a DMSP-20, whose measured map these values fit
        slope = factor * 6e5 / scales.pressure
        return cls(
            1.2e-4 * slope, 420 * factor, -57.0, -8.7e-3 * slope, 2.7e-3 * slope, -310 * factor
        )

    def force(self, pressure: Value, contraction: Value) -> Value:
        decaying = (self.a1 * pressure + self.a2) * ops.exp(self.a3 * contraction)
        return decaying + self.a4 * contraction * pressure + self.a5 * pressure + self.a6
