"""MechanismWrapper: base class of wrappers of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.ops import Value
from ...core.variables import Input
from .base import Coordinate, Mechanism


class MechanismWrapper(Mechanism):
    """Wrapper that forwards everything to the inner mechanism; subclasses override forces or contractions."""

    inner: Mechanism

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return self.inner.coordinates

    @property
    def inputs(self) -> tuple[Input, ...]:
        return self.inner.inputs

    @property
    def muscle_count(self) -> int | None:
        return self.inner.muscle_count

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return self.inner.contractions(q, resting_lengths)

    def contraction_speeds(
        self, q: Mapping[str, Value], v: Mapping[str, Value], resting_lengths: Sequence[Value]
    ) -> tuple[Value, ...]:
        return self.inner.contraction_speeds(q, v, resting_lengths)

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return self.inner.generalised_forces(q, tensions, resting_lengths)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return self.inner.acceleration(q, v, forces, inputs)

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.inner.dissipated_power(q, v, forces, inputs)

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.inner.potential_energy(q)

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return self.inner.kinetic_energy(q, v)
