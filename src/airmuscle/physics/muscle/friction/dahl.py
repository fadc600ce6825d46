"""Dahl friction model: one bristle with gradual sliding."""

from typing import Any, ClassVar, Self

from ....core import Reference, StateVariable, Value, Values, model, ops, parameter, published
from .base import Friction
from .path import LoopScales, deflection


@model
class Dahl(Friction):
    """Dahl model: dz/dt = v - sigma_0 |v| z/F_C,  F = sigma_0 z.

    z: deflection of the bristle [m]; v: speed [m/s]; sigma_0: stiffness of the bristle; F_C: Coulomb force. From the
    relaxed state, F = F_C (1 - exp(-sigma_0 x/F_C)). Rate-independent; small inner loops do not close but drift.
    Reference: Dahl (1968), with exponent 1.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("dahl-1968"),)

    stiffness: float = parameter("N/m", "sigma_0", "stiffness of the bristle", bounds=(1e-3, 1e9))
    coulomb_force: float = parameter("N", "F_C", "friction force in steady sliding", bounds=(1e-6, 1e5))

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.stiffness, scales.amplitude)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("bristle", "m", self.presliding_distance, "deflection of the bristle"),)

    @property
    def presliding_distance(self) -> float:
        return self.coulomb_force / self.stiffness

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        ratio = self.stiffness * bristles["bristle"] / self.coulomb_force
        return {"bristle": speed - ops.absolute_value(speed) * ratio}

    def force(self, bristles: Values, speed: Value) -> Value:
        return self.stiffness * bristles["bristle"]

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.stiffness * deflection(displacement, self.presliding_distance)
