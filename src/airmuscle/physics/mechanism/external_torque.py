"""JointWithExternalTorque: a joint on which a torque acts from outside, as a load or a disturbance."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import check_structure, model
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.variables import Input
from .base import Mechanism
from .wrapper import MechanismWrapper


@model
class JointWithExternalTorque(MechanismWrapper):
    """M theta'' = Q + tau_e: the input `external_torque` tau_e adds to the torque Q of the muscles on a joint.

    It is a load that is picked up, a push, or the torque of a test bench; positive in the direction of the angle. Its
    power is part of the power that leaves the mechanism. The mechanism has one coordinate, an angle.
    """

    inner: Mechanism

    def check(self) -> None:
        check_structure(self)
        coordinates = self.inner.coordinates
        if len(coordinates) != 1 or coordinates[0].unit != "rad":
            names = ", ".join(f"{c.name} [{c.unit}]" for c in coordinates) or "none"
            raise ParameterError(
                f"JointWithExternalTorque: the coordinates of {type(self.inner).__name__} are {names}; it needs a "
                "mechanism with one angle, such as AntagonisticJoint."
            )

    @property
    def inputs(self) -> tuple[Input, ...]:
        torque = Input("external_torque", "N m", -1e4, 1e4, "torque on the joint from outside")
        return (torque, *self.inner.inputs)

    def _with_torque(self, forces: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        name = self.inner.coordinates[0].name
        return {**forces, name: forces[name] + inputs["external_torque"]}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return self.inner.acceleration(q, v, self._with_torque(forces, inputs), inputs)

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        inner = self.inner.dissipated_power(q, v, self._with_torque(forces, inputs), inputs)
        return inner - inputs["external_torque"] * v[self.inner.coordinates[0].speed]
