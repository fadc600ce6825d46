"""What a friction law is: bristles that a motion bends, and the force with which they hold it back."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, ClassVar

from ..core.declaration import model
from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import StateVariable


class Friction(abc.ABC):
    """A force against the motion that depends on the path which led here.

    Bristles are mappings by the names of `states`; `speed` [m/s] and force [N] are positive in the direction in
    which the muscle shortens, and the force counts against its tension. No law asks for the sign of the speed, so
    that the rates are continuous and a plant stays easy to integrate.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    rate_independent: ClassVar[bool] = True
    """Whether the force depends on the path alone, however fast it was run through."""
    linear_in: ClassVar[str | None] = None
    """The field in which the force of `replay` is linear, if there is one: a fit then needs no search."""

    @property
    @abc.abstractmethod
    def states(self) -> tuple[StateVariable, ...]:
        """The bristles; all are 0 in a muscle that has never moved."""

    @abc.abstractmethod
    def rates(self, bristles: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        """The time derivative of every bristle."""

    @abc.abstractmethod
    def force(self, bristles: Mapping[str, Value], speed: Value) -> Value:
        """Force against the motion [N]."""

    @abc.abstractmethod
    def force_along(self, displacement: Any, time: Any = None) -> Any:
        """Force [N] along a path [m] that starts with relaxed bristles; NumPy arrays of shape (N,).

        The motion is taken as straight from one row to the next: turning points must be rows. `time` [s] matters to
        laws that depend on speed; without it the motion is slow.
        """

    @property
    @abc.abstractmethod
    def presliding_distance(self) -> float:
        """Displacement from rest within which the force builds up [m], for figures and nominal sizes."""

    def initial_state(self) -> dict[str, Value]:
        """The bristles of a muscle that has never moved."""
        return {state.name: 0.0 for state in self.states}


@model
class NoFriction(Friction):
    """F = 0: a muscle without hysteresis."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return ()

    def rates(self, bristles: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        return {}

    def force(self, bristles: Mapping[str, Value], speed: Value) -> Value:
        return 0.0

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return 0.0 * displacement

    @property
    def presliding_distance(self) -> float:
        return 0.0
