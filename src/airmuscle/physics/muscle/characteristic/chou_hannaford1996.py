"""Chou and Hannaford 1996: ideal McKibben muscle, a braided cylinder without a wall."""

from typing import ClassVar, Self

from ....core import Reference, Value, model, ops
from ..geometry.braid import CHOU_HANNAFORD_1996, Braid
from .base import MIN_PRESSURE, AreaLaw
from .data_scales import DataScales, MeasuredPoints
from .solve import check_solution


@model
class ChouHannaford1996(AreaLaw):
    """Ideal McKibben muscle: F = p b^2/(4 pi n^2) (3 L^2/b^2 - 1).

        b = L_0/cos(theta_0),   n = b sin(theta_0)/(2 pi r_0),   L = L_0 (1 - eps)

    b: length of a thread; n: number of its turns; p: gauge pressure; r_0, theta_0, L_0: parameters
    of the braid. Wall, friction and end caps are neglected. The force is zero at cos(theta) =
    1/sqrt(3), where the volume is maximum. The equation is solved in closed form for each quantity.
    Reference: Chou and Hannaford (1996), from F = -p dV/dL.
    """

    references: ClassVar[tuple[Reference, ...]] = (CHOU_HANNAFORD_1996,)

    geometry: Braid

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        return cls(DataScales.of(data).braid)

    @property
    def thread(self) -> Value:
        """Length b of a thread [m]."""
        return self.geometry.resting_length / ops.cos(self.geometry.braid_angle)

    @property
    def turns(self) -> Value:
        """Number of turns n of a thread around the muscle [1]."""
        return (
            self.thread * ops.sin(self.geometry.braid_angle) / (2 * ops.pi * self.geometry.radius)
        )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From straight threads to the maximum volume."""
        start, _ = self.geometry.contraction_range
        return (start, 1.0 - self.thread / (ops.sqrt(3.0) * self.geometry.resting_length))

    def contraction(self, pressure: Value, force: Value) -> Value:
        ratio = (
            force
            / ops.where(pressure == 0.0, MIN_PRESSURE, pressure)
            * 4
            * ops.pi
            * self.turns**2
            / self.thread**2
        )
        solution = 1.0 - self.thread * ops.sqrt((ratio + 1) / 3) / self.geometry.resting_length
        return check_solution(
            solution, self.contraction_range, (pressure, force), self._contraction_limits_message
        )

    def effective_area(self, contraction: Value) -> Value:
        length = self.geometry.resting_length * (1.0 - contraction)
        return self.thread**2 / (4 * ops.pi * self.turns**2) * (3 * length**2 / self.thread**2 - 1)
