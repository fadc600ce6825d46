"""A wrapper: any force law, held within a range of force."""

from __future__ import annotations

from ..core import ops
from ..core.errors import ParameterError
from ..core.model import model, parameter
from ..core.ops import Value
from .base import ForceLaw


@model
class Clamped(ForceLaw):
    """F = min(max(F_inner, F_min), F_max): a muscle pulls and never pushes, and a compensator limits its force."""

    inner: ForceLaw
    least_force: float = parameter(
        "N", "F_min", "force that the clamp lets through at least", fitted=False, default=0.0
    )
    greatest_force: float = parameter(
        "N", "F_max", "force that the clamp lets through at most", fitted=False, default=1.0e5
    )

    def check(self) -> None:
        if not self.least_force < self.greatest_force:
            raise ParameterError(
                f"Clamped: least_force {self.least_force:g} N must lie below greatest_force {self.greatest_force:g} N."
            )

    @property
    def contraction_reach(self) -> tuple[float, float]:
        return self.inner.contraction_reach

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.clip(self.inner.force(pressure, contraction), self.least_force, self.greatest_force)

    def unclamped(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.unclamped(pressure, contraction)
