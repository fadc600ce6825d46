"""Dampers: viscous elements in parallel with the contractile element."""

from __future__ import annotations

import abc

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value


class Damper(abc.ABC):
    """Viscous damper with one damping coefficient [N s/m] for each direction of motion (interface)."""

    @abc.abstractmethod
    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        """Damping coefficients [N s/m] for shortening and lengthening at gauge pressure [Pa] and contraction."""

    def force(self, pressure: Value, contraction: Value, speed: Value) -> Value:
        """Damping force [N] that opposes shortening at a speed [m/s]."""
        shortening, lengthening = self.coefficients(pressure, contraction)
        if shortening is lengthening:
            return shortening * speed
        return ops.where(speed >= 0, shortening, lengthening) * speed

    def speed(self, pressure: Value, contraction: Value, force: Value, extra_damping: Value = 0.0) -> Value:
        """Speed of shortening [m/s] at which the damper balances a force [N].

        `extra_damping` [N s/m] is the coefficient of another damper in parallel.
        """
        shortening, lengthening = self.coefficients(pressure, contraction)
        if shortening is lengthening:
            return force / (shortening + extra_damping)
        return force / (ops.where(force >= 0, shortening, lengthening) + extra_damping)


@model
class LinearDamper(Damper):
    """Linear damper: F_TL = b v with a constant coefficient b."""

    damping: float = parameter("N s/m", "b", "damping coefficient", bounds=(0.0, 1e6))

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        return self.damping, self.damping


@model
class PressureDamper(Damper):
    """Pressure-dependent damper: F_TL = max(b_0 + b_p p, 0) v with gauge pressure p."""

    damping: float = parameter("N s/m", "b_0", "damping coefficient at ambient pressure", bounds=(0.0, 1e6))
    damping_slope: float = parameter(
        "N s/(m Pa)", "b_p", "slope of the coefficient over gauge pressure", bounds=(0.0, 1.0)
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        coefficient = ops.maximum(self.damping + self.damping_slope * pressure, 0.0)
        return coefficient, coefficient


@model
class DirectionalDamper(Damper):
    """Direction-dependent damper: F_TL = b(p) v with b = max(b_0 + b_p p, 0), separate for shortening and lengthening.

    p gauge pressure. Reynolds et al. (2003) identify damping in this form: `Reynolds2003Damper` has their values,
    `Serres2009Damper` has those of a Festo muscle. The force is continuous at zero speed.
    """

    shortening: float = parameter("N s/m", "b_c0", "shortening coefficient at ambient pressure", bounds=(0.0, 1e6))
    lengthening: float = parameter("N s/m", "b_r0", "lengthening coefficient at ambient pressure", bounds=(0.0, 1e6))
    shortening_slope: float = parameter(
        "N s/(m Pa)", "b_cp", "slope of the shortening coefficient over pressure", bounds=(-1.0, 1.0), default=0.0
    )
    lengthening_slope: float = parameter(
        "N s/(m Pa)", "b_rp", "slope of the lengthening coefficient over pressure", bounds=(-1.0, 1.0), default=0.0
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        shortening = self.shortening + self.shortening_slope * pressure
        lengthening = self.lengthening + self.lengthening_slope * pressure
        return ops.maximum(shortening, 0.0), ops.maximum(lengthening, 0.0)
