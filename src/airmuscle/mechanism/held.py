"""A latch around any mechanism: what quick-release experiments let go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..declare import model
from ..ops import Value
from ..variables import Input
from .base import Coordinate, Mechanism


@model
class Held(Mechanism):
    """While the input `held` is 1 the mechanism rests and the latch carries what is out of balance; 0 frees it.

    The input must change at an instant, from rest.
    """

    inner: Mechanism

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return self.inner.coordinates

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("held", meaning="1 held, 0 free"), *self.inner.inputs)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return self.inner.contractions(q, resting_lengths)

    def pulls(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return self.inner.pulls(q, tensions, resting_lengths)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        free = self.inner.acceleration(q, v, pulls, inputs)
        return {name: (1.0 - inputs["held"]) * value for name, value in free.items()}

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.inner.potential_energy(q)

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return self.inner.kinetic_energy(q, v)
