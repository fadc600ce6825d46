"""Wrapper that limits the force of any force law."""

from __future__ import annotations

from ....core import ops
from ....core.declaration import model, parameter
from ....core.errors import ParameterError
from ....core.ops import Value
from .base import ForceLaw


@model
class Clamped(ForceLaw):
    """Limited force: F = min(max(F_inner, F_min), F_max).

    A muscle pulls and never pushes; the upper limit is that of the force compensator or of the catalogue.
    """

    inner: ForceLaw
    min_force: float = parameter("N", "F_min", "lower limit of the force", fitted=False, default=0.0)
    max_force: float = parameter("N", "F_max", "upper limit of the force", fitted=False, default=1.0e5)

    def check(self) -> None:
        if not self.min_force < self.max_force:
            raise ParameterError(
                f"Clamped: min_force {self.min_force:g} N must be less than max_force {self.max_force:g} N."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return self.inner.contraction_range

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.clip(self.inner.force(pressure, contraction), self.min_force, self.max_force)

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.unclamped_force(pressure, contraction)
