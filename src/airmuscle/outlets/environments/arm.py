"""Reaching of joint angles by a planar arm."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.units import bar
from ...physics.plant import Plant
from .task import EnvironmentTask, Observation


@model
class ArmReaching(EnvironmentTask):
    """Reaching of angles that are constant in an episode by an arm with any number of joints; all numbers are chosen.

    The plant has rotational coordinates only. Observed are all angles, their speeds, the pressures of all muscles, and
    the references. The errors are scaled by `error_scale`. An episode ends where an angle exceeds `largest_angle`, or a
    number is not finite.
    """

    plant: Plant
    targets: tuple[float, ...] = parameter("rad", "theta_r", "reference angles", bounds=(-3.2, 3.2), default=(0.0, 0.0))
    error_scale: float = parameter("rad", "e_0", "error at which the reward is 0.37", bounds=(1e-6, 10.0), default=0.05)
    largest_angle: float = parameter("rad", "theta_max", "angle that ends an episode", bounds=(0.0, 3.2), default=0.5)
    effort_weight: float = parameter("1", "w", "weight of the effort in the reward", bounds=(0.0, 1.0), default=0.01)
    period: float = parameter("s", "T", "period of the actions", bounds=(1e-6, 10.0), default=0.01)
    initial_angle: float = parameter("rad", "theta_0", "largest initial angle", bounds=(0.0, 3.0), default=0.03)
    min_pressure: float = parameter("Pa", "p_min", "lowest initial pressure", bounds=(0.0, 1e6), default=2.5e5)
    max_pressure: float = parameter("Pa", "p_max", "highest initial pressure", bounds=(0.0, 1e6), default=3.5e5)

    @property
    def observations(self) -> tuple[Observation, ...]:
        joints = self.plant.mechanism.coordinates
        return (
            *(Observation(c.name, "rad", -3.2, 3.2, "joint angle") for c in joints),
            *(Observation(c.speed, "rad/s", -50.0, 50.0, "speed of a joint angle") for c in joints),
            *(Observation(f"{p}pressure", "bar", -1.1, 20.0, "gauge pressure") for p in self.plant.prefixes),
            *(Observation(f"{c.name}.target", "rad", -3.2, 3.2, "reference angle") for c in joints),
        )

    @property
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        pressures = {f"{p}pressure": (self.min_pressure, self.max_pressure) for p in self.plant.prefixes}
        angles = {c.name: (-self.initial_angle, self.initial_angle) for c in self.plant.mechanism.coordinates}
        return {**pressures, **angles}

    def observe(self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        joints = self.plant.mechanism.coordinates
        pressures = (outputs[f"{p}pressure"] / bar for p in self.plant.prefixes)
        moving = (state[c.speed] for c in joints)
        return (*(state[c.name] for c in joints), *moving, *pressures, *self.targets)

    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        pairs = zip(self.plant.mechanism.coordinates, self.targets, strict=True)
        return tuple((state[c.name] - target) / self.error_scale for c, target in pairs)

    def ends(self, state: Mapping[str, Value]) -> Value:
        angles = (ops.absolute_value(state[c.name]) for c in self.plant.mechanism.coordinates)
        return sum(ops.where(angle > self.largest_angle, 1.0, 0.0) for angle in angles) > 0.5
