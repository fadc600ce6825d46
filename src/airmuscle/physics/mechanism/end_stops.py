"""End stops of a mechanism: Hunt-Crossley contacts at both ends of the range of a coordinate."""

from typing import ClassVar

from ...core import ParameterError, Reference, Value, Values, model, ops, parameter, published
from ...core.declaration import forwarded
from .base import Mechanism
from .wrapper import CoordinateWrapper


@model
class HuntCrossley:
    """Hunt-Crossley contact: F = K delta^(3/2) max(1 + c delta', 0).

    delta contact depth [m]. The force is zero and continuous at the beginning and the end of
    contact and never pulls. For a slow impact at a speed v, the coefficient of restitution is about
    1 - 2/3 c v (0.933 for c v = 0.1; the exact value is 0.938). Reference: Hunt and Crossley
    (1975), with the exponent of Hertz.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("hunt-crossley-1975"),)

    stiffness: float = parameter("N/m^1.5", "K", "stiffness of the contact", bounds=(1.0, 1e12))
    damping: float = parameter(
        "s/m", "c", "damping of the contact", bounds=(0.0, 100.0), default=0.5
    )

    def force(self, depth: Value, speed: Value) -> Value:
        """Contact force [N] at a depth [m], 0 without contact, that increases at a speed [m/s]."""
        return self.elastic_force(depth) * ops.maximum(1.0 + self.damping * speed, 0.0)

    def elastic_force(self, depth: Value) -> Value:
        """Elastic part of the contact force [N] at a depth [m]; times c it is the damping
        coefficient [N s/m].
        """
        return self.stiffness * depth * _regularised_sqrt(depth)

    def elastic_energy(self, depth: Value) -> Value:
        """Elastic energy [J] at a depth [m]: (2/5) K delta^(5/2)."""
        return 0.4 * self.stiffness * depth**2 * _regularised_sqrt(depth)


def _regularised_sqrt(depth: Value) -> Value:
    """Square root with a finite derivative at zero, where the factor depth makes the product
    zero.
    """
    return ops.sqrt(ops.maximum(depth, 1e-30))


class EndStops(CoordinateWrapper):
    """Two Hunt-Crossley contacts that add a generalised force Q to one coordinate q (base class).

        Q = R (F(delta_low) - F(delta_high)),   delta_low = max(R (q_low - q), 0),   delta_high =
                                                max(R (q - q_high), 0)

    F contact force at the contact depth delta; R lever arm of the contact, 1 for a coordinate in
    metres.
    """

    inner: Mechanism
    contact: HuntCrossley
    lower_stop: float
    upper_stop: float
    what: ClassVar[str] = "end stops"
    lever_arm: Value
    """Displacement of the contact point per unit of the coordinate."""

    def check(self) -> None:
        super().check()
        owner = type(self).__name__
        low = self.lower_stop
        high = self.upper_stop
        if not low < high:
            raise ParameterError(
                f"{owner}: lower_stop is {low:g}; it must be less than upper_stop, {high:g}."
            )

    def _contacts(self, q: Values, v: Values) -> tuple[tuple[Value, Value], ...]:
        """Depth of each contact and its time derivative."""
        position = q[self.acted_on.name]
        speed = v[self.acted_on.speed]
        return (
            (
                self.lever_arm * ops.maximum(self.lower_stop - position, 0.0),
                -self.lever_arm * speed,
            ),
            (self.lever_arm * ops.maximum(position - self.upper_stop, 0.0), self.lever_arm * speed),
        )

    def stop_force(self, q: Values, v: Values) -> Value:
        """Generalised force of both end stops on the coordinate [N] or [N m]."""
        lower, upper = (self.contact.force(depth, speed) for depth, speed in self._contacts(q, v))
        return self.lever_arm * (lower - upper)

    def with_own_forces(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {**forces, self.acted_on.name: forces[self.acted_on.name] + self.stop_force(q, v)}

    def own_loss(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        force = self.contact.force
        return sum(
            (force(depth, speed) - force(depth, 0.0)) * speed
            for depth, speed in self._contacts(q, v)
        )

    def potential_energy(self, q: Values) -> Value:
        contacts = self._contacts(q, {self.acted_on.speed: 0.0})
        return sum(
            self.contact.elastic_energy(depth) for depth, _ in contacts
        ) + self.inner.potential_energy(q)


@model
class WithEndStops(EndStops):
    """End stops of a position; between the stops the motion of the inner mechanism is unchanged."""

    inner: Mechanism
    lower_stop: float = parameter(
        "m", "y_low", "position at which the lower contact begins", bounds=(-10.0, 10.0)
    )
    upper_stop: float = parameter(
        "m", "y_high", "position at which the upper contact begins", bounds=(-10.0, 10.0)
    )
    contact: HuntCrossley
    coordinate: str = ""
    """Name of the coordinate with end stops; required if several coordinates have this unit."""
    unit: ClassVar[str] = "m"

    lever_arm = 1.0


@model
class JointWithEndStops(EndStops):
    """End stops of an angle; the contacts act at a distance R from the axis."""

    inner: Mechanism
    lower_stop: float = parameter(
        "rad", "theta_low", "angle at which the lower contact begins", bounds=(-10.0, 10.0)
    )
    upper_stop: float = parameter(
        "rad", "theta_high", "angle at which the upper contact begins", bounds=(-10.0, 10.0)
    )
    stop_radius: float = parameter(
        "m", "R", "distance of the stops from the axis", bounds=(1e-3, 10.0)
    )
    contact: HuntCrossley
    coordinate: str = ""
    """Name of the coordinate with end stops; required if several coordinates have this unit."""
    unit: ClassVar[str] = "rad"

    lever_arm = forwarded("stop_radius")
