"""A latch around any mechanism: what quick-release experiments let go."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.declaration import model
from ..core.ops import Value
from ..core.variables import Input
from .base import Mechanism
from .wrapper import MechanismWrapper


@model
class Held(MechanismWrapper):
    """While the input `held` is 1 the mechanism rests and the latch carries what is out of balance; 0 frees it.

    The input must change at an instant, from rest.
    """

    inner: Mechanism

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("held", meaning="1 held, 0 free"), *self.inner.inputs)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        free = self.inner.acceleration(q, v, pulls, inputs)
        return {name: (1.0 - inputs["held"]) * value for name, value in free.items()}
