"""A weight below the muscle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..declare import model, parameter
from ..ops import Value
from .base import Coordinate, Mechanism

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s2] (ISO 80000-3)."""


@model
class HangingMass(Mechanism):
    """m y'' = F - m g, with y upwards from where the muscle has its resting length."""

    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("position", "speed", "m", 0.01, 0.1),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(q["position"] / length for length in resting_lengths)

    def pulls(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return {"position": sum(tensions, 0.0)}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {"position": pulls["position"] / self.mass - self.gravity}

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.mass * self.gravity * q["position"]

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self.mass * v["speed"] ** 2
