"""Translation (base class): a mass on which all muscles act in parallel along one line."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence

from ...core.ops import Value
from .base import Coordinate, Mechanism


class Translation(Mechanism, abc.ABC):
    """One coordinate: the position y [m], which is the shortening of the muscles from their resting length."""

    mass: float

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("position", "speed", "m", 0.01, 0.1),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(q["position"] / length for length in resting_lengths)

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return {"position": sum(tensions, 0.0)}

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self.mass * v["speed"] ** 2
