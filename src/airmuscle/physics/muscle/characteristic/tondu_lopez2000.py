"""Tondu and Lopez 2000: braided muscle with an end correction."""

from typing import ClassVar, Self

from ....core import Reference, Value, model, ops, parameter, published
from ..geometry.braid import Braid
from .base import MIN_PRESSURE, AreaLaw
from .data_scales import DataScales, MeasuredPoints
from .solve import check_solution

TONDU_LOPEZ_2000 = published("tondu-lopez-2000")


@model
class TonduLopez2000(AreaLaw):
    """Braided muscle with end correction: F = pi r_0^2 p (a (1 - k eps)^2 - b).

    a = 3/tan(alpha_0)^2, b = 1/sin(alpha_0)^2; r_0, alpha_0: radius and angle of the braid at rest.
    The middle contracts by k eps, with an end correction k > 1, because the tapered ends do not
    contract; k = 1 gives the model of Chou and Hannaford. All quantities are solved in closed form.
    Reference: Tondu and Lopez (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000,)

    geometry: Braid
    end_correction: float = parameter(
        "1",
        "k",
        "contraction of the middle relative to that of the whole muscle",
        bounds=(1.0, 3.0),
        default=1.0,
    )

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        return cls(DataScales.of(data).braid, 1.1)

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From straight threads in the middle to zero force."""
        start, _ = self.geometry.contraction_range
        zero_force = 1.0 - ops.sqrt(self._b / self._a)
        return (start / self.end_correction, zero_force / self.end_correction)

    def contraction(self, pressure: Value, force: Value) -> Value:
        ratio = force / (
            ops.where(pressure == 0.0, MIN_PRESSURE, pressure) * ops.pi * self.geometry.radius**2
        )
        solution = (1.0 - ops.sqrt((ratio + self._b) / self._a)) / self.end_correction
        return check_solution(
            solution, self.contraction_range, (pressure, force), self._contraction_limits_message
        )

    def effective_area(self, contraction: Value) -> Value:
        middle = 1.0 - self.end_correction * contraction
        return ops.pi * self.geometry.radius**2 * (self._a * middle**2 - self._b)

    @property
    def _a(self) -> Value:
        return 3.0 / ops.tan(self.geometry.braid_angle) ** 2

    @property
    def _b(self) -> Value:
        return 1.0 / ops.sin(self.geometry.braid_angle) ** 2
