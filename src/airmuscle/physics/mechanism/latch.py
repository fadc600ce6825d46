"""Latch around a mechanism, for quick-release experiments."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import model
from ...core.ops import Value
from ...core.variables import Input
from .base import Mechanism
from .wrapper import MechanismWrapper


@model
class WithLatch(MechanismWrapper):
    """Mechanism with a latch: while the input `latched` is 1, all accelerations are 0; at 0 the mechanism is free.

    The latch carries the unbalanced forces. Start the simulation at rest and switch the input in a single step.
    """

    inner: Mechanism

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("latched", meaning="1 latched, 0 released"), *self.inner.inputs)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        free = self.inner.acceleration(q, v, forces, inputs)
        return {name: (1.0 - inputs["latched"]) * value for name, value in free.items()}
