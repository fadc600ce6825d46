"""An end stop inside a muscle: it cannot shorten beyond a limit."""

from __future__ import annotations

import abc

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..mechanism.contact import HuntCrossley


class Stop(abc.ABC):
    """What keeps a muscle from shortening further; it may push."""

    @abc.abstractmethod
    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        """Force [N] against contraction [1] at a speed of shortening [m/s]."""

    @abc.abstractmethod
    def parts(self, contraction: Value, resting_length: Value) -> tuple[Value, Value]:
        """Force [N] at standstill, and the coefficient [N s/m] by which it grows with the speed of shortening."""


@model
class NoStop(Stop):
    """Nothing but its own law ends the muscle's way."""

    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        return 0.0

    def parts(self, contraction: Value, resting_length: Value) -> tuple[Value, Value]:
        return 0.0, 0.0


@model
class EndStop(Stop):
    """A contact after Hunt and Crossley that begins at a contraction."""

    contraction: float = parameter("1", "eps_s", "contraction at which the contact begins", bounds=(-0.5, 0.95))
    contact: HuntCrossley

    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        return self.contact.force(self.depth(contraction, resting_length), speed)

    def parts(self, contraction: Value, resting_length: Value) -> tuple[Value, Value]:
        still = self.contact.elastic(self.depth(contraction, resting_length))
        return still, self.contact.damping * still

    def depth(self, contraction: Value, resting_length: Value) -> Value:
        """How far [m] the muscle is beyond where the contact begins."""
        return ops.maximum(contraction - self.contraction, 0.0) * resting_length
