"""End stops of a mechanism, as contacts at both ends of a coordinate's way."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from ..core import ops
from ..core.declaration import check_structure, model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from .base import Coordinate, Mechanism
from .contact import HuntCrossley
from .wrapper import MechanismWrapper


class EndStops(MechanismWrapper):
    """Two contacts after Hunt and Crossley, which add to the pull on one coordinate.

        Q = R (F(delta_low) - F(delta_high)),   delta_low = max(R (q_low - q), 0),   delta_high = max(R (q - q_high), 0)

    F law of the contact at its depth delta; R lever of the contact, 1 for a way in metres.
    """

    inner: Mechanism
    contact: HuntCrossley
    coordinate: str
    unit: ClassVar[str]

    @property
    @abc.abstractmethod
    def ends(self) -> tuple[Value, Value]:
        """The least and the greatest value of the coordinate between the stops."""

    @property
    @abc.abstractmethod
    def arm(self) -> Value:
        """Way of the contact for each unit of the coordinate."""

    def check(self) -> None:
        check_structure(self)
        fitting = [c.name for c in self.inner.coordinates if c.unit == self.unit]
        name = type(self).__name__
        if self.coordinate and self.coordinate not in fitting:
            raise ParameterError(
                f"{name}: no coordinate '{self.coordinate}' in {self.unit}; {type(self.inner).__name__} has "
                f"{', '.join(fitting) or 'none'}."
            )
        if not self.coordinate and len(fitting) != 1:
            raise ParameterError(
                f"{name}: {type(self.inner).__name__} has {len(fitting)} coordinates in {self.unit}; name the one "
                f"that is stopped: coordinate = {' or '.join(fitting) or 'one of another mechanism'}."
            )
        if not self.ends[0] < self.ends[1]:
            raise ParameterError(f"{name}: its least {self.ends[0]:g} must lie below its greatest {self.ends[1]:g}.")

    @property
    def stopped(self) -> Coordinate:
        """The coordinate that the stops act on."""
        return next(c for c in self.inner.coordinates if c.unit == self.unit and self.coordinate in ("", c.name))

    def _contacts(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> tuple[tuple[Value, Value], ...]:
        """Depth of each contact and the speed at which it grows."""
        (low, high), place, speed = self.ends, q[self.stopped.name], v[self.stopped.speed]
        return (
            (self.arm * ops.maximum(low - place, 0.0), -self.arm * speed),
            (self.arm * ops.maximum(place - high, 0.0), self.arm * speed),
        )

    def push(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        """Generalised force of both stops on the coordinate [N, N m]."""
        at_low, at_high = (self.contact.force(depth, speed) for depth, speed in self._contacts(q, v))
        return self.arm * (at_low - at_high)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return self.inner.acceleration(q, v, self._pushed(q, v, pulls), inputs)

    def _pushed(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {**pulls, self.stopped.name: pulls[self.stopped.name] + self.push(q, v)}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        damped = sum(
            (self.contact.force(depth, speed) - self.contact.force(depth, 0.0)) * speed
            for depth, speed in self._contacts(q, v)
        )
        return damped + self.inner.dissipated_power(q, v, self._pushed(q, v, pulls), inputs)

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        still = {self.stopped.speed: 0.0}
        held = sum(self.contact.energy(depth) for depth, _ in self._contacts(q, still))
        return held + self.inner.potential_energy(q)


@model
class WithEndStops(EndStops):
    """A way that ends at two stops; between them the inner mechanism is as free as without."""

    inner: Mechanism
    lower_stop: float = parameter("m", "y_low", "position at which the lower contact begins", bounds=(-10.0, 10.0))
    upper_stop: float = parameter("m", "y_high", "position at which the upper contact begins", bounds=(-10.0, 10.0))
    contact: HuntCrossley
    coordinate: str = ""
    """Which coordinate is stopped, where there are several."""
    unit: ClassVar[str] = "m"

    @property
    def ends(self) -> tuple[Value, Value]:
        return self.lower_stop, self.upper_stop

    @property
    def arm(self) -> Value:
        return 1.0


@model
class JointWithEndStops(EndStops):
    """An angle that ends at two stops, which touch at a lever R from its axis."""

    inner: Mechanism
    lower_stop: float = parameter("rad", "theta_low", "angle at which the lower contact begins", bounds=(-10.0, 10.0))
    upper_stop: float = parameter("rad", "theta_high", "angle at which the upper contact begins", bounds=(-10.0, 10.0))
    lever: float = parameter("m", "R", "distance of the stops from the axis", bounds=(1e-3, 10.0))
    contact: HuntCrossley
    coordinate: str = ""
    """Which coordinate is stopped, where there are several."""
    unit: ClassVar[str] = "rad"

    @property
    def ends(self) -> tuple[Value, Value]:
        return self.lower_stop, self.upper_stop

    @property
    def arm(self) -> Value:
        return self.lever
