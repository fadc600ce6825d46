"""The tension of any geometry by virtual work: a muscle without wall or friction, which keeps energy."""

from __future__ import annotations

from typing import ClassVar

from ..core.declaration import model
from ..core.errors import TraceError
from ..core.ops import Value
from ..core.reference import Reference
from ..geometry.base import Geometry
from ..geometry.braid import CHOU_HANNAFORD_1996
from .base import ForceLaw, Slopes
from .solve import check_solution


@model
class VirtualWork(ForceLaw):
    """F = -p dV/dL = p (dV/deps)/L_0.

    p gauge pressure, V enclosed volume, L = L_0 (1 - eps) length. The work of the air, p dV, is all given to
    the load, so the Maxwell defect dF/dp + dV/dL is zero everywhere. Past the contraction of greatest volume
    the muscle pushes; clamp it where it must not. Reference: Chou and Hannaford (1996), the derivation of
    their force.
    """

    references: ClassVar[tuple[Reference, ...]] = (CHOU_HANNAFORD_1996,)

    geometry: Geometry

    @property
    def contraction_range(self) -> tuple[float, float]:
        return self.geometry.contraction_range

    def force(self, pressure: Value, contraction: Value) -> Value:
        return pressure * self.effective_area(contraction)

    def pressure(self, contraction: Value, force: Value) -> Value:
        found = force / self.effective_area(contraction)
        return check_solution(found, self.pressure_range, (contraction, force), self._no_pressure_message)

    def effective_area(self, contraction: Value) -> Value:
        """F/p [m2]: the piston that the muscle is worth at a contraction [1]."""
        return self.geometry.volume_derivative(contraction) / self.geometry.resting_length

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        if not type(self.geometry).traceable:
            raise TraceError(
                f"VirtualWork: {type(self.geometry).__name__} is not closed-form, so its second derivative is not "
                "known exactly. Replace it by airmuscle.geometry.chebyshev.as_polynomial(geometry)."
            )
        return super().slopes(pressure, contraction)
