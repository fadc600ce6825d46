"""Ideal muscle of any geometry by the principle of virtual work, without wall stiffness or friction."""

from __future__ import annotations

from typing import ClassVar

from ....core.declaration import model
from ....core.errors import TraceError
from ....core.ops import Value
from ....core.reference import Reference
from ..geometry.base import Geometry
from ..geometry.braid import CHOU_HANNAFORD_1996
from .base import ForceLaw, Slopes
from .solve import check_solution


@model
class VirtualWork(ForceLaw):
    """Virtual work: F = -p dV/dL = p (dV/deps)/L_0.

    p: gauge pressure; V: enclosed volume; L = L_0 (1 - eps): length. The work p dV of the air is transferred to the
    load without loss, so that the Maxwell defect dF/dp + dV/dL is zero everywhere. Above the contraction of maximum
    volume the force is negative; limit it with `Clamped` if required.
    Reference: Chou and Hannaford (1996), derivation of the force.
    """

    references: ClassVar[tuple[Reference, ...]] = (CHOU_HANNAFORD_1996,)

    geometry: Geometry

    @property
    def contraction_range(self) -> tuple[float, float]:
        return self.geometry.contraction_range

    def force(self, pressure: Value, contraction: Value) -> Value:
        return pressure * self.effective_area(contraction)

    def pressure(self, contraction: Value, force: Value) -> Value:
        solution = force / self.effective_area(contraction)
        return check_solution(solution, self.pressure_range, (contraction, force), self._no_pressure_message)

    def effective_area(self, contraction: Value) -> Value:
        """Effective area F/p [m2] at a contraction [1], the area of an equivalent piston."""
        return self.geometry.volume_derivative(contraction) / self.geometry.resting_length

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        if not type(self.geometry).traceable:
            raise TraceError(
                f"VirtualWork: {type(self.geometry).__name__} is not in closed form, so that its second derivative "
                "is not available. Replace it by airmuscle.physics.muscle.geometry.chebyshev.as_polynomial(geometry)."
            )
        return super().slopes(pressure, contraction)
