"""LuGre friction model: bristle with the Stribeck effect, and viscous friction."""

from typing import Any, ClassVar, Self

from ....core import Reference, StateVariable, Value, Values, model, ops, parameter, published
from .base import Friction
from .path import LoopScales, compute_speed, deflection


@model
class LuGre(Friction):
    """LuGre model: dz/dt = v - sigma_0 |v| z/g(v),  F = sigma_0 z + sigma_1 dz/dt + sigma_2 v.

    g(v) = F_C + (F_S - F_C) exp(-(v/v_S)^2).

    z: mean deflection of the bristles [m]; v: speed [m/s]; g(v): force in steady sliding (Stribeck curve); F_C: Coulomb
    force; F_S: static friction force; v_S: Stribeck speed; sigma_1, sigma_2: damping of the bristles and viscous
    damping. Steady sliding gives F = g(v) sgn v + sigma_2 v. The map from speed to force is passive if
    sigma_2 > sigma_1 (F_S - F_C)/F_C. For quasi-static motion the model reduces to the Dahl model with F_S.
    Reference: Canudas de Wit et al. (1995).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("canudas-de-wit-1995"),)
    rate_independent: ClassVar[bool] = False

    stiffness: float = parameter("N/m", "sigma_0", "stiffness of the bristles", bounds=(1e-3, 1e9))
    coulomb_force: float = parameter("N", "F_C", "Coulomb force: friction force in fast sliding", bounds=(1e-6, 1e5))
    stribeck_force: float = parameter(
        "N", "F_S - F_C", "static friction force minus Coulomb force", bounds=(0.0, 1e5), default=0.0
    )
    stribeck_speed: float = parameter("m/s", "v_S", "Stribeck speed", bounds=(1e-6, 100.0), default=0.01)
    bristle_damping: float = parameter("N s/m", "sigma_1", "damping of the bristles", bounds=(0.0, 1e6), default=0.0)
    damping: float = parameter("N s/m", "sigma_2", "viscous damping", bounds=(0.0, 1e6), default=0.0)

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.stiffness, scales.amplitude, 0.2 * scales.amplitude, scales.stroke / 5.0)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("bristle", "m", self.presliding_distance, "mean deflection of the bristles"),)

    @property
    def presliding_distance(self) -> float:
        return (self.coulomb_force + self.stribeck_force) / self.stiffness

    def sliding_force(self, speed: Value) -> Value:
        """Magnitude g(v) of the bristle force in steady sliding [N]."""
        return self.coulomb_force + self.stribeck_force * ops.exp(-((speed / self.stribeck_speed) ** 2))

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        ratio = self.stiffness * bristles["bristle"] / self.sliding_force(speed)
        return {"bristle": speed - ops.absolute_value(speed) * ratio}

    def force(self, bristles: Values, speed: Value) -> Value:
        rate = self.rates(bristles, speed)["bristle"]
        return self.stiffness * bristles["bristle"] + self.bristle_damping * rate + self.damping * speed

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        if time is None:
            return self.stiffness * deflection(displacement, self.presliding_distance)
        speed = compute_speed(displacement, time)
        bristle = deflection(displacement, self.sliding_force(speed) / self.stiffness)
        return self.force({"bristle": bristle}, speed)
