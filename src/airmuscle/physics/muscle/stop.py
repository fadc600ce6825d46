"""End stops inside a muscle: limits of its contraction."""

from __future__ import annotations

import abc

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ..mechanism.contact import HuntCrossley


class Stop(abc.ABC):
    """Element that limits the contraction of a muscle by a pushing force (interface)."""

    @abc.abstractmethod
    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        """Force [N] against contraction at a speed of shortening [m/s]."""

    @abc.abstractmethod
    def static_force_and_damping(self, contraction: Value, resting_length: Value) -> tuple[Value, Value]:
        """Force [N] at zero speed, and the slope of the force over the speed of shortening [N s/m]."""


@model
class NoStop(Stop):
    """No end stop: the contraction is limited by the force law alone."""

    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        return 0.0

    def static_force_and_damping(self, contraction: Value, resting_length: Value) -> tuple[Value, Value]:
        return 0.0, 0.0


@model
class EndStop(Stop):
    """End stop: a Hunt-Crossley contact that begins at a given contraction."""

    contraction: float = parameter("1", "eps_s", "contraction at which the contact begins", bounds=(-0.5, 0.95))
    contact: HuntCrossley

    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        return self.contact.force(self.depth(contraction, resting_length), speed)

    def static_force_and_damping(self, contraction: Value, resting_length: Value) -> tuple[Value, Value]:
        static_force = self.contact.elastic_force(self.depth(contraction, resting_length))
        return static_force, self.contact.damping * static_force

    def depth(self, contraction: Value, resting_length: Value) -> Value:
        """Contact depth [m]; 0 without contact."""
        return ops.maximum(contraction - self.contraction, 0.0) * resting_length
