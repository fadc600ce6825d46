"""Joint friction: dry friction of a bearing, regularised about zero speed."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.declaration import check_structure, model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from .base import Coordinate, Mechanism
from .wrapper import MechanismWrapper


@model
class JointWithFriction(MechanismWrapper):
    """Regularised Coulomb friction of a joint: Q_f = -T_c w/sqrt(w^2 + w_0^2).

    w angular speed, T_c friction torque, w_0 regularising speed: above about 3 w_0 the torque is within 5 % of T_c. The
    friction torque is zero at rest, so that a joint under load creeps with a speed below w_0 instead of sticking;
    equilibria are those without friction. Viscous friction is a parameter of the inner mechanism.
    """

    inner: Mechanism
    friction_torque: float = parameter("N m", "T_c", "friction torque", bounds=(0.0, 1e4))
    regularising_speed: float = parameter(
        "rad/s", "w_0", "regularising speed", bounds=(1e-6, 10.0), fitted=False, default=0.01
    )
    coordinate: str = ""
    """Name of the angle with friction; required if several coordinates are angles."""

    def check(self) -> None:
        check_structure(self)
        angles = [c.name for c in self.inner.coordinates if c.unit == "rad"]
        owner = type(self.inner).__name__
        if not angles:
            raise ParameterError(f"JointWithFriction: {owner} has no angle; use another mechanism.")
        if self.coordinate and self.coordinate not in angles:
            raise ParameterError(
                f"JointWithFriction: its coordinate is '{self.coordinate}'; allowed are the angles of {owner}: "
                f"{', '.join(angles)}."
            )
        if not self.coordinate and len(angles) > 1:
            raise ParameterError(
                f"JointWithFriction: {owner} has {len(angles)} angles; set coordinate to the one with friction: "
                f"{' or '.join(angles)}."
            )

    @property
    def angle(self) -> Coordinate:
        """Angle on which the friction acts."""
        return next(c for c in self.inner.coordinates if c.unit == "rad" and self.coordinate in ("", c.name))

    def friction(self, angular_speed: Value) -> Value:
        """Generalised friction force [N m] at an angular speed [rad/s]."""
        return -self.friction_torque * angular_speed / ops.sqrt(angular_speed**2 + self.regularising_speed**2)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return self.inner.acceleration(q, v, self._with_friction(v, forces), inputs)

    def _with_friction(self, v: Mapping[str, Value], forces: Mapping[str, Value]) -> Mapping[str, Value]:
        name = self.angle.name
        return {**forces, name: forces[name] + self.friction(v[self.angle.speed])}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        speed = v[self.angle.speed]
        inner = self.inner.dissipated_power(q, v, self._with_friction(v, forces), inputs)
        return inner - self.friction(speed) * speed
