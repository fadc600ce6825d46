"""Hanging mass: a weight below the muscle."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.constants import STANDARD_GRAVITY
from ...core.declaration import model, parameter
from ...core.ops import Value
from .translation import Translation


@model
class HangingMass(Translation):
    """Hanging mass: m y'' = F - m g, with y upwards from the position at the resting length of the muscle."""

    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {"position": forces["position"] / self.mass - self.gravity}

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.mass * self.gravity * q["position"]
