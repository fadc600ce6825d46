"""A constant force against the muscle, as a force-controlled bench holds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..declare import model, parameter
from ..ops import Value
from .base import Coordinate, Mechanism


@model
class Isotonic(Mechanism):
    """m y'' = F - F_c - d y', with y from where the muscle has its resting length.

    F_c constant force, m mass that moves along and does not weigh, d damping. The smaller the mass, the nearer the
    tension stays to F_c. All muscles pull at the same place.
    """

    force: float = parameter("N", "F_c", "constant force against the muscles", bounds=(0.0, 1e6))
    mass: float = parameter("kg", "m", "mass that moves along", bounds=(1e-4, 1e5))
    damping: float = parameter("N s/m", "d", "damping coefficient of the load", bounds=(0.0, 1e6), default=0.0)

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
        return {"position": (pulls["position"] - self.force - self.damping * v["speed"]) / self.mass}

    def lost_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.force * q["position"]

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self.mass * v["speed"] ** 2
