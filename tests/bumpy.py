"""A mechanism whose rests are known by hand, for tests of the search for them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from airmuscle.core import model, parameter
from airmuscle.physics import Coordinate, Mechanism


@model
class Bumpy(Mechanism):
    """x'' = (x - middle)^2 - half^2, whatever the muscle does: two rests, 2 half apart, the first
    stable.
    """

    middle: float = parameter("m", "a", "place between the two")
    half: float = parameter("m", "d", "half of their distance")

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("position", "speed", "m", 0.01, 0.1),)

    def contractions(self, q: Mapping[str, Any], resting_lengths: Any) -> tuple[Any, ...]:
        return tuple(q["position"] / length for length in resting_lengths)

    def acceleration(
        self,
        q: Mapping[str, Any],
        v: Mapping[str, Any],
        pulls: Mapping[str, Any],
        inputs: Mapping[str, Any],
    ) -> Mapping[str, Any]:
        return {"position": (q["position"] - self.middle) ** 2 - self.half**2}
