"""Bouc-Wen hysteresis model in normalised form."""

from typing import Any, ClassVar, Self

from ....core import Reference, StateVariable, Value, Values, model, ops, parameter, published
from .base import Friction
from .path import LoopScales, relative_deflection

MIN_RELATIVE_DEFLECTION = 1e-12
"""Lower bound of |w|, so that its powers are differentiable at zero (chosen)."""


@model
class BoucWen(Friction):
    """Bouc-Wen model: dz/dt = v - sigma |v| |w|^(n-1) w + (sigma - 1) v |w|^n,  w = k z/F_C,  F = F_C w = k z.

    z: deflection [m]; w: deflection relative to its limit [1]; k: initial stiffness; F_C: limit of the force;
    n: sharpness of the transition; sigma: shape of unloading. The usual parameters A, beta, gamma are redundant; this
    is the normalised form, rho = k/F_C. The elastic part of the Bouc-Wen model is the parallel spring of the muscle.
    n = sigma = 1 gives the Dahl model; n to infinity gives a single slip element. Rate-independent; inner loops drift,
    as in the Dahl model. Reference: Bouc (1967), Wen (1976); normalised form: Ismail, Ikhouane and Rodellar (2009).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("bouc-1967"),
        published("wen-1976"),
        published("ismail-2009"),
    )

    stiffness: float = parameter("N/m", "k", "initial stiffness", bounds=(1e-3, 1e9))
    coulomb_force: float = parameter("N", "F_C", "friction force in steady sliding", bounds=(1e-6, 1e5))
    sharpness: float = parameter("1", "n", "sharpness of the transition to sliding", bounds=(1.0, 20.0), default=1.0)
    unloading: float = parameter("1", "sigma", "shape of unloading", bounds=(0.5, 20.0), default=0.5)

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.stiffness, scales.amplitude, 1.5, 0.6)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("bristle", "m", self.presliding_distance, "deflection of the bristle"),)

    @property
    def presliding_distance(self) -> float:
        return self.coulomb_force / self.stiffness

    def _deflection_rate(self, ratio: Value, speed: Value) -> Value:
        """dz/dt [m/s] at the relative deflection w = `ratio`."""
        power = ops.maximum(ops.absolute_value(ratio), MIN_RELATIVE_DEFLECTION) ** (self.sharpness - 1.0)
        dissipative = self.unloading * ops.absolute_value(speed) * ratio
        directional = (self.unloading - 1.0) * speed * ops.absolute_value(ratio)
        return speed + power * (directional - dissipative)

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        return {"bristle": self._deflection_rate(bristles["bristle"] * self.stiffness / self.coulomb_force, speed)}

    def force(self, bristles: Values, speed: Value) -> Value:
        return self.stiffness * bristles["bristle"]

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.coulomb_force * relative_deflection(self._deflection_rate, displacement, self.presliding_distance)
