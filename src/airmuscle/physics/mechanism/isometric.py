"""Isometric load: the muscle is fixed at a constant length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.declaration import model, parameter
from ...core.ops import Value
from .base import Coordinate, Mechanism


@model
class Isometric(Mechanism):
    """Isometric load: constant contraction eps; the mechanism has no degree of freedom."""

    contraction: float = parameter("1", "eps", "contraction at which the muscle is fixed", bounds=(-0.2, 0.9))

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return ()

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(self.contraction for _ in resting_lengths)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {}
