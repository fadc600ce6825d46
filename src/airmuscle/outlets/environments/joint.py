"""Tracking of an angle by an antagonistic joint."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.units import bar
from ...physics.plant import Plant
from .task import EnvironmentTask, Observation


@model
class JointTracking(EnvironmentTask):
    """Tracking of a sine by a joint: theta_r(t) = A sin(2 pi f t + phi); all numbers are chosen.

    The plant has one coordinate 'angle' and two muscles. Observed are the angle, its speed, the pressures of both
    muscles, and the reference now and one period later. The error theta - theta_r is scaled by `error_scale`. An
    episode ends where the angle exceeds `largest_angle`, or a number is not finite.
    """

    plant: Plant
    target_amplitude: float = parameter("rad", "A", "amplitude of the reference", bounds=(0.0, 3.0), default=0.3)
    target_frequency: float = parameter("Hz", "f", "frequency of the reference", bounds=(0.0, 100.0), default=0.5)
    target_phase: float = parameter("rad", "phi", "phase of the reference", bounds=(-10.0, 10.0), default=0.0)
    error_scale: float = parameter("rad", "e_0", "error at which the reward is 0.37", bounds=(1e-6, 10.0), default=0.1)
    largest_angle: float = parameter("rad", "theta_max", "angle that ends an episode", bounds=(0.0, 3.2), default=0.785)
    effort_weight: float = parameter("1", "w", "weight of the effort in the reward", bounds=(0.0, 1.0), default=0.01)
    period: float = parameter("s", "T", "period of the actions", bounds=(1e-6, 10.0), default=0.01)
    initial_angle: float = parameter("rad", "theta_0", "largest initial angle", bounds=(0.0, 3.0), default=0.1)
    min_pressure: float = parameter("Pa", "p_min", "lowest initial pressure", bounds=(0.0, 1e6), default=1.5e5)
    max_pressure: float = parameter("Pa", "p_max", "highest initial pressure", bounds=(0.0, 1e6), default=2.5e5)

    @property
    def observations(self) -> tuple[Observation, ...]:
        reference = "reference angle"
        return (
            Observation("angle", "rad", -3.2, 3.2, "joint angle"),
            Observation("angular_speed", "rad/s", -50.0, 50.0, "speed of the joint angle"),
            *(Observation(f"{p}pressure", "bar", -1.1, 20.0, "gauge pressure") for p in self.plant.prefixes),
            Observation("target", "rad", -3.2, 3.2, reference),
            Observation("next_target", "rad", -3.2, 3.2, f"{reference} one period later"),
        )

    @property
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        pressures = {f"{p}pressure": (self.min_pressure, self.max_pressure) for p in self.plant.prefixes}
        return {**pressures, "angle": (-self.initial_angle, self.initial_angle)}

    def target(self, time: Value) -> Value:
        """The reference [rad] at a time [s]."""
        return self.target_amplitude * ops.sin(2.0 * ops.pi * self.target_frequency * time + self.target_phase)

    def observe(self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        pressures = (outputs[f"{p}pressure"] / bar for p in self.plant.prefixes)
        later = self.target(time + self.period)
        return (state["angle"], state["angular_speed"], *pressures, self.target(time), later)

    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        return ((state["angle"] - self.target(time)) / self.error_scale,)

    def ends(self, state: Mapping[str, Value]) -> Value:
        return ops.absolute_value(state["angle"]) > self.largest_angle
