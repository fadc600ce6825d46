"""Antagonistic joint: two muscles that rotate a joint in opposite directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from .base import Coordinate, Mechanism


@model
class AntagonisticJoint(Mechanism):
    """Antagonistic joint: J theta'' = r (F_1 - F_2) - M sin theta - b theta'.

        eps_1 = eps_0 + r theta/L0_1,   eps_2 = eps_0 - r theta/L0_2

    theta joint angle, 0 where the weight hangs vertically downwards; the first muscle increases it, the second
    decreases it. r pulley radius of both muscles, eps_0 contraction of both at theta = 0, J inertia, b viscous
    friction, M = m g l torque of the weight at theta = 90 degrees: positive for a hanging, negative for an inverted
    pendulum.
    """

    radius: float = parameter("m", "r", "pulley radius of both muscles", bounds=(1e-3, 1.0))
    inertia: float = parameter("kg m^2", "J", "moment of inertia about the joint axis", bounds=(1e-6, 1e4))
    damping: float = parameter("N m s/rad", "b", "viscous friction of the joint", bounds=(0.0, 1e4), default=0.0)
    weight_torque: float = parameter("N m", "M", "torque of the weight at 90 degrees", bounds=(-1e5, 1e5), default=0.0)
    offset: float = parameter("1", "eps_0", "contraction of both muscles at angle 0", bounds=(-0.5, 0.9), default=0.0)

    @property
    def muscle_count(self) -> int | None:
        return 2

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("angle", "angular_speed", "rad", 0.1, 1.0, -ops.pi, ops.pi),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        displacement, (first, second) = self.radius * q["angle"], resting_lengths
        return (self.offset + displacement / first, self.offset - displacement / second)

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return {"angle": self.radius * (tensions[0] - tensions[1])}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        resistance = self.weight_torque * ops.sin(q["angle"]) + self.damping * v["angular_speed"]
        return {"angle": (forces["angle"] - resistance) / self.inertia}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["angular_speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.weight_torque * (1.0 - ops.cos(q["angle"]))

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self.inertia * v["angular_speed"] ** 2
