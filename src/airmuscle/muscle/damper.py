"""The damper of a muscle."""

from __future__ import annotations

import abc

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value


class Damper(abc.ABC):
    """Damper of a muscle: a coefficient [N s/m] for each direction, times the speed."""

    @abc.abstractmethod
    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        """Coefficients [N s/m] of shortening and of lengthening, at gauge pressure [Pa] and contraction [1]."""

    def force(self, pressure: Value, contraction: Value, speed: Value) -> Value:
        """Force [N] against a speed of contraction [m/s]."""
        shortening, lengthening = self.coefficients(pressure, contraction)
        if shortening is lengthening:
            return shortening * speed
        return ops.where(speed >= 0, shortening, lengthening) * speed

    def speed(self, pressure: Value, contraction: Value, force: Value, beside: Value = 0.0) -> Value:
        """Speed of contraction [m/s] at which the damper, with a coefficient [N s/m] `beside` it, holds a force [N]."""
        shortening, lengthening = self.coefficients(pressure, contraction)
        if shortening is lengthening:
            return force / (shortening + beside)
        return force / (ops.where(force >= 0, shortening, lengthening) + beside)


@model
class LinearDamper(Damper):
    """F_TL = b v, with a constant coefficient."""

    damping: float = parameter("N s/m", "b", "damping coefficient", bounds=(0.0, 1e6))

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        return self.damping, self.damping


@model
class PressureDamper(Damper):
    """F_TL = max(b_0 + b_p p, 0) v: a coefficient that grows linearly with gauge pressure, and never drives."""

    damping: float = parameter("N s/m", "b_0", "damping coefficient at ambient pressure", bounds=(0.0, 1e6))
    growth: float = parameter("N s/(m Pa)", "b_p", "growth of the coefficient with gauge pressure", bounds=(0.0, 1.0))

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        coefficient = ops.maximum(self.damping + self.growth * pressure, 0.0)
        return coefficient, coefficient


@model
class DirectionalDamper(Damper):
    """F_TL = b(p) v, with one line b = max(b_0 + b_p p, 0) for shortening and another for lengthening.

    p gauge pressure. The form in which Reynolds et al. (2003) identify damping (`Reynolds2003Damper` has their numbers,
    `Serres2009Damper` those of a Festo muscle). The force is continuous at standstill.
    """

    shortening: float = parameter("N s/m", "b_c0", "coefficient of shortening at ambient pressure", bounds=(0.0, 1e6))
    lengthening: float = parameter("N s/m", "b_r0", "coefficient of lengthening at ambient pressure", bounds=(0.0, 1e6))
    shortening_growth: float = parameter(
        "N s/(m Pa)", "b_cp", "its growth with gauge pressure", bounds=(-1.0, 1.0), default=0.0
    )
    lengthening_growth: float = parameter(
        "N s/(m Pa)", "b_rp", "its growth with gauge pressure", bounds=(-1.0, 1.0), default=0.0
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        shortening = self.shortening + self.shortening_growth * pressure
        lengthening = self.lengthening + self.lengthening_growth * pressure
        return ops.maximum(shortening, 0.0), ops.maximum(lengthening, 0.0)
