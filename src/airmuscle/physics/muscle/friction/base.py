"""Friction (interface): hysteresis models with internal bristle states."""

import abc
from typing import Any, ClassVar, NamedTuple, Self

from ....core import Reference, StateVariable, Value, Values, model
from .path import LoopScales


class IdentifiedRange(NamedTuple):
    """Lower and upper limits of the gauge pressure [Pa] and of the speed [m/s] in the data of a friction law."""

    pressure: tuple[float, float]
    speed: tuple[float, float]


class Friction(abc.ABC):
    """Friction force that depends on the history of the displacement.

    Bristle deflections are mappings keyed by the names of `states`. `speed` [m/s] and force [N] are positive in the
    direction of shortening, and the force is subtracted from the tension of the muscle. No model uses the sign of the
    speed, so that the rates are continuous and can be integrated with large steps. The friction of a muscle is `force`
    times `pressure_factor`.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    rate_independent: ClassVar[bool] = True
    """Whether the force depends on the path only, not on the speed."""
    linear_in: ClassVar[str | None] = None
    """The field in which the force of `force_along` is linear, or None; a fit solves for it by linear least squares."""

    @classmethod
    def guess(cls, scales: LoopScales) -> Self | None:
        """The law with initial parameters for a fit to a loop of these scales; None for a law that is not fitted."""
        return None

    @property
    @abc.abstractmethod
    def states(self) -> tuple[StateVariable, ...]:
        """The bristle deflections; all are zero in the relaxed state."""

    @abc.abstractmethod
    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        """Time derivative of every bristle deflection at a speed [m/s]."""

    @abc.abstractmethod
    def force(self, bristles: Values, speed: Value) -> Value:
        """Friction force [N] at a speed [m/s]."""

    @abc.abstractmethod
    def force_along(self, displacement: Any, time: Any = None) -> Any:
        """Force [N] along a displacement path [m] that starts with relaxed bristles; NumPy arrays of shape (N,).

        The motion is assumed linear between rows, so that every turning point must be a row. `time` [s] is used by
        rate-dependent models; without it the motion is quasi-static.
        """

    @property
    @abc.abstractmethod
    def presliding_distance(self) -> float:
        """Characteristic displacement of presliding [m], used for plots and nominal sizes."""

    @property
    def identified_range(self) -> IdentifiedRange | None:
        """The range of the data to which the parameters were fitted; None if it is not known."""
        return None

    def pressure_factor(self, pressure: Value) -> Value:
        """Factor of the force at a gauge pressure [Pa]; 1 unless the friction depends on the pressure."""
        return 1.0

    def initial_state(self) -> dict[str, Value]:
        """Bristle deflections of the relaxed state, all zero."""
        return {state.name: 0.0 for state in self.states}


@model
class NoFriction(Friction):
    """No friction: F = 0."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return ()

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        return {}

    def force(self, bristles: Values, speed: Value) -> Value:
        return 0.0

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return 0.0 * displacement

    @property
    def presliding_distance(self) -> float:
        return 0.0
