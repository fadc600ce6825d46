"""Lever with a mass, rotated by muscles on lever arms."""

from collections.abc import Sequence

from ...core import STANDARD_GRAVITY, ParameterError, Value, Values, model, ops, parameter
from .base import Coordinate, Mechanism


@model
class Lever(Mechanism):
    """Lever: (J + m b^2) phi'' = sum F_i d(L0_i eps_i)/dphi - m g b cos phi - d phi'.

        eps_i = 1 - sqrt((a_i cos phi - a_i)^2 + (h_i - a_i sin phi)^2)/L0_i,   h_i = L0_i (1 - eps_0i)

    phi angle from the horizontal, a_i lever arm of muscle i, whose fixed end is vertically above its attachment point
    at phi = 0; b lever arm of the mass m; J inertia of the lever without the mass, d viscous friction. A muscle on a
    negative arm acts in the opposite direction. eps_0i is the contraction of muscle i at phi = 0.
    """

    arms: tuple[float, ...] = parameter("m", "a_i", "lever arm of each muscle", bounds=(-10.0, 10.0))
    mass: float = parameter("kg", "m", "mass of the load", bounds=(0.0, 1e5))
    load_arm: float = parameter("m", "b", "lever arm of the load", bounds=(-10.0, 10.0))
    inertia: float = parameter(
        "kg m^2", "J", "moment of inertia of the lever without the load", bounds=(0.0, 1e4), default=0.0
    )
    damping: float = parameter("N m s/rad", "d", "viscous friction of the bearing", bounds=(0.0, 1e5), default=0.0)
    offsets: tuple[float, ...] = parameter(
        "1", "eps_0i", "contraction of each muscle at angle 0", bounds=(-0.5, 0.9), default=()
    )
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    def check(self) -> None:
        if not self.arms or len(self.offsets) not in (0, len(self.arms)):
            raise ParameterError(
                f"Lever: {len(self.arms)} arms and {len(self.offsets)} offsets are given; give one arm for each "
                "muscle, and one offset for each or no offsets."
            )
        if not self._total_inertia() > 0.0:
            raise ParameterError("Lever: the total inertia is zero; give an inertia, or a mass with a load_arm.")

    @property
    def muscle_count(self) -> int | None:
        return len(self.arms)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("angle", "angular_speed", "rad", 0.05, 1.0, -0.5 * ops.pi, 0.5 * ops.pi),)

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        horizontal, vertical = ops.cos(q["angle"]) - 1.0, ops.sin(q["angle"])
        offsets = self.offsets or (0.0,) * len(self.arms)
        contractions = []
        for arm, offset, length in zip(self.arms, offsets, resting_lengths, strict=True):
            height = length * (1.0 - offset)
            contractions.append(1.0 - ops.sqrt((arm * horizontal) ** 2 + (height - arm * vertical) ** 2) / length)
        return tuple(contractions)

    def _total_inertia(self) -> Value:
        return self.inertia + self.mass * self.load_arm**2

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        weight = self.mass * self.gravity * self.load_arm * ops.cos(q["angle"])
        return {"angle": (forces["angle"] - weight - self.damping * v["angular_speed"]) / self._total_inertia()}

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return self.damping * v["angular_speed"] ** 2

    def potential_energy(self, q: Values) -> Value:
        return self.mass * self.gravity * self.load_arm * ops.sin(q["angle"])

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        return 0.5 * self._total_inertia() * v["angular_speed"] ** 2
