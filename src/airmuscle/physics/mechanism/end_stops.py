"""End stops of a mechanism: contacts at both ends of the range of a coordinate."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import check_structure, model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from .base import Coordinate, Mechanism
from .contact import HuntCrossley
from .wrapper import MechanismWrapper


class EndStops(MechanismWrapper):
    """Two Hunt-Crossley contacts that add a generalised force Q to one coordinate q (base class).

        Q = R (F(delta_low) - F(delta_high)),   delta_low = max(R (q_low - q), 0),   delta_high = max(R (q - q_high), 0)

    F contact force at the contact depth delta; R lever arm of the contact, 1 for a coordinate in metres.
    """

    inner: Mechanism
    contact: HuntCrossley
    coordinate: str
    unit: ClassVar[str]

    @property
    @abc.abstractmethod
    def stop_positions(self) -> tuple[Value, Value]:
        """Values of the coordinate at which the lower and the upper contact begin."""

    @property
    @abc.abstractmethod
    def lever_arm(self) -> Value:
        """Displacement of the contact point per unit of the coordinate."""

    def check(self) -> None:
        check_structure(self)
        candidates = [c.name for c in self.inner.coordinates if c.unit == self.unit]
        name = type(self).__name__
        if self.coordinate and self.coordinate not in candidates:
            raise ParameterError(
                f"{name}: no coordinate '{self.coordinate}' in {self.unit}; {type(self.inner).__name__} has "
                f"{', '.join(candidates) or 'none'}."
            )
        if not candidates:
            raise ParameterError(
                f"{name}: {type(self.inner).__name__} has no coordinate in {self.unit}; use another mechanism or other "
                "end stops."
            )
        if not self.coordinate and len(candidates) > 1:
            raise ParameterError(
                f"{name}: {type(self.inner).__name__} has {len(candidates)} coordinates in {self.unit}; set coordinate "
                f"to the one with end stops: {' or '.join(candidates)}."
            )
        low, high = self.stop_positions
        if not low < high:
            raise ParameterError(f"{name}: lower_stop is {low:g}; it must be less than upper_stop, {high:g}.")

    @property
    def stopped_coordinate(self) -> Coordinate:
        """Coordinate on which the end stops act."""
        return next(c for c in self.inner.coordinates if c.unit == self.unit and self.coordinate in ("", c.name))

    def _contacts(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> tuple[tuple[Value, Value], ...]:
        """Depth of each contact and its time derivative."""
        (low, high), coordinate = self.stop_positions, self.stopped_coordinate
        position, speed = q[coordinate.name], v[coordinate.speed]
        return (
            (self.lever_arm * ops.maximum(low - position, 0.0), -self.lever_arm * speed),
            (self.lever_arm * ops.maximum(position - high, 0.0), self.lever_arm * speed),
        )

    def stop_force(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        """Generalised force of both end stops on the coordinate [N] or [N m]."""
        lower, upper = (self.contact.force(depth, speed) for depth, speed in self._contacts(q, v))
        return self.lever_arm * (lower - upper)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return self.inner.acceleration(q, v, self._add_stop_force(q, v, forces), inputs)

    def _add_stop_force(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {**forces, self.stopped_coordinate.name: forces[self.stopped_coordinate.name] + self.stop_force(q, v)}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        damped = sum(
            (self.contact.force(depth, speed) - self.contact.force(depth, 0.0)) * speed
            for depth, speed in self._contacts(q, v)
        )
        return damped + self.inner.dissipated_power(q, v, self._add_stop_force(q, v, forces), inputs)

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        at_rest = {self.stopped_coordinate.speed: 0.0}
        elastic = sum(self.contact.elastic_energy(depth) for depth, _ in self._contacts(q, at_rest))
        return elastic + self.inner.potential_energy(q)


@model
class WithEndStops(EndStops):
    """End stops of a position; between the stops the motion of the inner mechanism is unchanged."""

    inner: Mechanism
    lower_stop: float = parameter("m", "y_low", "position at which the lower contact begins", bounds=(-10.0, 10.0))
    upper_stop: float = parameter("m", "y_high", "position at which the upper contact begins", bounds=(-10.0, 10.0))
    contact: HuntCrossley
    coordinate: str = ""
    """Name of the coordinate with end stops; required if several coordinates have this unit."""
    unit: ClassVar[str] = "m"

    @property
    def stop_positions(self) -> tuple[Value, Value]:
        return self.lower_stop, self.upper_stop

    @property
    def lever_arm(self) -> Value:
        return 1.0


@model
class JointWithEndStops(EndStops):
    """End stops of an angle; the contacts act at a distance R from the axis."""

    inner: Mechanism
    lower_stop: float = parameter("rad", "theta_low", "angle at which the lower contact begins", bounds=(-10.0, 10.0))
    upper_stop: float = parameter("rad", "theta_high", "angle at which the upper contact begins", bounds=(-10.0, 10.0))
    stop_radius: float = parameter("m", "R", "distance of the stops from the axis", bounds=(1e-3, 10.0))
    contact: HuntCrossley
    coordinate: str = ""
    """Name of the coordinate with end stops; required if several coordinates have this unit."""
    unit: ClassVar[str] = "rad"

    @property
    def stop_positions(self) -> tuple[Value, Value]:
        return self.lower_stop, self.upper_stop

    @property
    def lever_arm(self) -> Value:
        return self.stop_radius
