"""Two muscles that turn a joint against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from .base import Coordinate, Mechanism


@model
class AntagonisticJoint(Mechanism):
    """J theta'' = r (F_1 - F_2) - M sin theta - b theta'.

        eps_1 = eps_0 + r theta/L0_1,   eps_2 = eps_0 - r theta/L0_2

    theta angle from where the weight hangs straight down; the first muscle turns it forward, the second back. r radius
    of the pulley that both act on, eps_0 contraction of both at theta = 0, J inertia, b viscous friction, M = m g l
    torque of the weight at a right angle: positive hangs, negative stands on its head.
    """

    radius: float = parameter("m", "r", "radius of the pulley that both muscles act on", bounds=(1e-3, 1.0))
    inertia: float = parameter("kg m^2", "J", "moment of inertia about the joint", bounds=(1e-6, 1e4))
    damping: float = parameter("N m s/rad", "b", "viscous friction of the joint", bounds=(0.0, 1e4), default=0.0)
    weight_torque: float = parameter(
        "N m", "M", "torque of the weight at a right angle", bounds=(-1e5, 1e5), default=0.0
    )
    offset: float = parameter("1", "eps_0", "contraction of both muscles at angle 0", bounds=(-0.5, 0.9), default=0.0)

    @property
    def muscles(self) -> int | None:
        return 2

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("angle", "angular_speed", "rad", 0.1, 1.0, -ops.pi, ops.pi),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        way, (first, second) = self.radius * q["angle"], resting_lengths
        return (self.offset + way / first, self.offset - way / second)

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return {"angle": self.radius * (tensions[0] - tensions[1])}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        held = self.weight_torque * ops.sin(q["angle"]) + self.damping * v["angular_speed"]
        return {"angle": (pulls["angle"] - held) / self.inertia}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["angular_speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.weight_torque * (1.0 - ops.cos(q["angle"]))

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self.inertia * v["angular_speed"] ** 2
