"""Hunt 2017: pressure of a Festo muscle as a function of contraction, load and direction of
motion.
"""

from typing import ClassVar, Self

from ....core import ParameterError, Reference, Value, model, ops, parameter, published
from .base import PressureLaw
from .data_scales import DataScales, MeasuredPoints

_MAX_TANGENT_ARGUMENT = 1.5
"""Upper limit of the argument of the tangent; it corresponds to 2.9 MPa, above the strength of any
muscle.
"""
_MIN_SPAN = 1e-6
"""Lower limit of the contraction span, which the model does not restrict at high loads."""


@model
class Hunt2017(PressureLaw):
    """Hunt's model: p = p_0 + p_1 tan(c_1 (eps/(eps_max - b F) - c_2)) + a F + h S.

    eps: contraction; F: tension; S: direction of motion, +1 for shortening, -1 for lengthening, 0
    for isometric. The tangent is limited below its pole, at 2.9 MPa with the printed parameters.
    Reference: Hunt, Graber-Tilton and Quinn (2017).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("hunt-2017"),)
    linear_in: ClassVar[tuple[str, ...]] = ("offset", "scale", "by_force")

    max_contraction: float = parameter(
        "1",
        "eps_max",
        "contraction of the specimen at 620 kPa without load",
        bounds=(0.01, 0.5),
        fitted=False,
    )
    offset: float = parameter("Pa", "p_0", "pressure where the tangent is zero", default=254.3e3)
    scale: float = parameter(
        "Pa", "p_1", "scale of the tangent", bounds=(0.0, 1e7), default=192.0e3
    )
    steepness: float = parameter(
        "1", "c_1", "steepness of the tangent", bounds=(0.1, 2.8), default=2.0265
    )
    centre: float = parameter(
        "1",
        "c_2",
        "relative contraction where the tangent is zero",
        bounds=(0.0, 1.0),
        default=0.461,
    )
    span_by_force: float = parameter(
        "1/N",
        "b",
        "decrease of the maximum contraction with load",
        bounds=(0.0, 0.1),
        default=0.331e-3,
    )
    by_force: float = parameter(
        "Pa/N", "a", "increase of pressure with load", bounds=(0.0, 1e7), default=1.23e3
    )
    half_gap: float = parameter(
        "Pa",
        "h",
        "half of the pressure difference between the branches",
        bounds=(0.0, 1e6),
        fitted=False,
        default=15.6e3,
    )
    direction: int = 0

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        scales = DataScales.of(data).check_positive("force")
        factor = (
            450.0 / scales.force
        )  # the published values are of a 10 mm muscle, with a maximum force of about 450 N
        span = min(max(scales.contraction, 0.02), 0.5)
        shortening = 0.331e-3 * factor * span / 0.17
        stiffening = 1.23e3 * factor
        return cls(
            span, span_by_force=min(shortening, 0.1), by_force=min(stiffening, 1e7)
        )  # within their bounds

    def check(self) -> None:
        if self.direction not in (-1, 0, 1):
            raise ParameterError(
                f"Hunt2017.direction is {self.direction!r}; it must be 1 (shortening), -1"
                " (lengthening) or 0 (isometric)."
            )

    def pressure(self, contraction: Value, force: Value) -> Value:
        span = ops.maximum(self.max_contraction - self.span_by_force * force, _MIN_SPAN)
        argument = self.steepness * (contraction / span - self.centre)
        tangent = ops.tan(ops.clip(argument, -_MAX_TANGENT_ARGUMENT, _MAX_TANGENT_ARGUMENT))
        return (
            self.offset
            + self.scale * tangent
            + self.by_force * force
            + self.half_gap * self.direction
        )
