"""Lifting of a load to a height by one muscle."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.units import bar
from ...physics.plant import Plant
from .task import EnvironmentTask, Observation

_CM = 0.01
"""Centimetre [m], the unit of the observed heights."""


@model
class LoadLifting(EnvironmentTask):
    """Lifting of a load to a height y_r that is constant in an episode; all numbers are chosen.

    The plant has one coordinate 'position' and one muscle. Observed are the height, its speed, the pressure, and the
    reference. The error y - y_r is scaled by `error_scale`. An episode ends where the height is beyond `lowest` or
    `highest`, or a number is not finite.
    """

    plant: Plant
    target_height: float = parameter("m", "y_r", "reference height", bounds=(-1.0, 1.0), default=0.03)
    error_scale: float = parameter("m", "e_0", "error at which the reward is 0.37", bounds=(1e-6, 1.0), default=0.005)
    lowest: float = parameter("m", "y_min", "lower height that ends an episode", bounds=(-1.0, 1.0), default=-0.01)
    highest: float = parameter("m", "y_max", "upper height that ends an episode", bounds=(-1.0, 1.0), default=0.075)
    effort_weight: float = parameter("1", "w", "weight of the effort in the reward", bounds=(0.0, 1.0), default=0.01)
    period: float = parameter("s", "T", "period of the actions", bounds=(1e-6, 10.0), default=0.01)
    min_height: float = parameter("m", "y_0min", "lowest initial height", bounds=(-1.0, 1.0), default=0.005)
    max_height: float = parameter("m", "y_0max", "highest initial height", bounds=(-1.0, 1.0), default=0.02)
    min_pressure: float = parameter("Pa", "p_min", "lowest initial pressure", bounds=(0.0, 1e6), default=1.0e5)
    max_pressure: float = parameter("Pa", "p_max", "highest initial pressure", bounds=(0.0, 1e6), default=2.0e5)

    @property
    def observations(self) -> tuple[Observation, ...]:
        return (
            Observation("height", "cm", -50.0, 50.0, "height of the load"),
            Observation("speed", "m/s", -10.0, 10.0, "speed of the load"),
            Observation("pressure", "bar", -1.1, 20.0, "gauge pressure"),
            Observation("target", "cm", -50.0, 50.0, "reference height"),
        )

    @property
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        return {"pressure": (self.min_pressure, self.max_pressure), "position": (self.min_height, self.max_height)}

    def observe(self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        return state["position"] / _CM, state["speed"], outputs["pressure"] / bar, self.target_height / _CM

    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        return ((state["position"] - self.target_height) / self.error_scale,)

    def ends(self, state: Mapping[str, Value]) -> Value:
        below = ops.where(state["position"] < self.lowest, 1.0, 0.0)
        above = ops.where(state["position"] > self.highest, 1.0, 0.0)
        return below + above > 0.5
