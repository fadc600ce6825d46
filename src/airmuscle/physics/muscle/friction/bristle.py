"""Friction of bristles that slide gradually: the models of Dahl, of Canudas de Wit (LuGre), and of
Bouc and Wen.
"""

from typing import Any, ClassVar, Self

from ....core import Reference, StateVariable, Value, Values, model, ops, parameter, published
from .base import Friction
from .path import LoopScales, compute_speed, deflection, relative_deflection


class BristleFriction(Friction):
    """Friction of one bristle: dz/dt = v - sigma_0 |v| z/g(v),  F = sigma_0 z (interface; a law may
    differ).

    z: deflection of the bristle [m]; v: speed [m/s]; sigma_0: its stiffness; g(v): force in steady
    sliding.
    """

    bristle: ClassVar[str] = "deflection of the bristle"
    """Meaning of the state z."""
    stiffness: float
    coulomb_force: float

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("bristle", "m", self.presliding_distance, self.bristle),)

    @property
    def presliding_distance(self) -> float:
        return self.coulomb_force / self.stiffness

    def sliding_force(self, speed: Value) -> Value:
        """Magnitude g(v) of the bristle force in steady sliding [N]."""
        return self.coulomb_force

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        ratio = self.stiffness * bristles["bristle"] / self.sliding_force(speed)
        return {"bristle": speed - ops.absolute_value(speed) * ratio}

    def force(self, bristles: Values, speed: Value) -> Value:
        return self.stiffness * bristles["bristle"]


@model
class Dahl(BristleFriction):
    """Dahl model: dz/dt = v - sigma_0 |v| z/F_C,  F = sigma_0 z.

    z: deflection of the bristle [m]; v: speed [m/s]. From the relaxed state, F = F_C (1 -
    exp(-sigma_0 x/F_C)). Rate-independent; small inner loops do not close but drift. Reference:
    Dahl (1968), with exponent 1.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("dahl-1968"),)

    stiffness: float = parameter("N/m", "sigma_0", "stiffness of the bristle", bounds=(1e-3, 1e9))
    coulomb_force: float = parameter(
        "N", "F_C", "friction force in steady sliding", bounds=(1e-6, 1e5)
    )

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.stiffness, scales.amplitude)

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.stiffness * deflection(displacement, self.presliding_distance)


@model
class LuGre(BristleFriction):
    """LuGre model: dz/dt = v - sigma_0 |v| z/g(v),  F = sigma_0 z + sigma_1 dz/dt + sigma_2 v.

    g(v) = F_C + (F_S - F_C) exp(-(v/v_S)^2).

    z: mean deflection of the bristles [m]; v: speed [m/s]; g(v): force in steady sliding (Stribeck
    curve), which gives F = g(v) sgn v + sigma_2 v. The map from speed to force is passive if
    sigma_2 > sigma_1 (F_S - F_C)/F_C. For quasi-static motion the model reduces to the Dahl model
    with F_S. Reference: Canudas de Wit et al. (1995).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("canudas-de-wit-1995"),)
    rate_independent: ClassVar[bool] = False
    bristle: ClassVar[str] = "mean deflection of the bristles"

    stiffness: float = parameter("N/m", "sigma_0", "stiffness of the bristles", bounds=(1e-3, 1e9))
    coulomb_force: float = parameter(
        "N", "F_C", "Coulomb force: friction force in fast sliding", bounds=(1e-6, 1e5)
    )
    stribeck_force: float = parameter(
        "N",
        "F_S - F_C",
        "static friction force minus Coulomb force",
        bounds=(0.0, 1e5),
        default=0.0,
    )
    stribeck_speed: float = parameter(
        "m/s", "v_S", "Stribeck speed", bounds=(1e-6, 100.0), default=0.01
    )
    bristle_damping: float = parameter(
        "N s/m", "sigma_1", "damping of the bristles", bounds=(0.0, 1e6), default=0.0
    )
    damping: float = parameter(
        "N s/m", "sigma_2", "viscous damping", bounds=(0.0, 1e6), default=0.0
    )

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.stiffness, scales.amplitude, 0.2 * scales.amplitude, scales.stroke / 5.0)

    @property
    def presliding_distance(self) -> float:
        return (self.coulomb_force + self.stribeck_force) / self.stiffness

    def sliding_force(self, speed: Value) -> Value:
        return self.coulomb_force + self.stribeck_force * ops.exp(
            -((speed / self.stribeck_speed) ** 2)
        )

    def force(self, bristles: Values, speed: Value) -> Value:
        rate = self.rates(bristles, speed)["bristle"]
        return super().force(bristles, speed) + self.bristle_damping * rate + self.damping * speed

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        if time is None:
            return self.stiffness * deflection(displacement, self.presliding_distance)
        speed = compute_speed(displacement, time)
        bristle = deflection(displacement, self.sliding_force(speed) / self.stiffness)
        return self.force({"bristle": bristle}, speed)


MIN_RELATIVE_DEFLECTION = 1e-12
"""Lower bound of |w|, so that its powers are differentiable at zero (chosen)."""


@model
class BoucWen(BristleFriction):
    """Bouc-Wen model: dz/dt = v - sigma |v| |w|^(n-1) w + (sigma - 1) v |w|^n,  w = k z/F_C,  F =
    F_C w = k z.

    z: deflection [m]; w: deflection relative to its limit [1]; k: initial stiffness; F_C: limit of
    the force; n: sharpness of the transition; sigma: shape of unloading. The usual parameters A,
    beta, gamma are redundant; this is the normalised form, rho = k/F_C. The elastic part of the
    Bouc-Wen model is the parallel spring of the muscle. n = sigma = 1 gives the Dahl model; n to
    infinity gives a single slip element. Rate-independent; inner loops drift, as in the Dahl model.
    Reference: Bouc (1967), Wen (1976); normalised form: Ismail, Ikhouane and Rodellar (2009).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("bouc-1967"),
        published("wen-1976"),
        published("ismail-2009"),
    )

    stiffness: float = parameter("N/m", "k", "initial stiffness", bounds=(1e-3, 1e9))
    coulomb_force: float = parameter(
        "N", "F_C", "friction force in steady sliding", bounds=(1e-6, 1e5)
    )
    sharpness: float = parameter(
        "1", "n", "sharpness of the transition to sliding", bounds=(1.0, 20.0), default=1.0
    )
    unloading: float = parameter(
        "1", "sigma", "shape of unloading", bounds=(0.5, 20.0), default=0.5
    )

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.stiffness, scales.amplitude, 1.5, 0.6)

    def _deflection_rate(self, ratio: Value, speed: Value) -> Value:
        """dz/dt [m/s] at the relative deflection w = `ratio`."""
        power = ops.maximum(ops.absolute_value(ratio), MIN_RELATIVE_DEFLECTION) ** (
            self.sharpness - 1.0
        )
        dissipative = self.unloading * ops.absolute_value(speed) * ratio
        directional = (self.unloading - 1.0) * speed * ops.absolute_value(ratio)
        return speed + power * (directional - dissipative)

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        return {
            "bristle": self._deflection_rate(
                bristles["bristle"] * self.stiffness / self.coulomb_force, speed
            )
        }

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.coulomb_force * relative_deflection(
            self._deflection_rate, displacement, self.presliding_distance
        )
