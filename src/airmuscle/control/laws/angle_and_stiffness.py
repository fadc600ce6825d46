"""AngleAndStiffness: control of the angle and the stiffness of a joint by the pressures of two muscles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.controller import Measurement
from ...physics.muscle.characteristic.tondu_lopez2000 import TONDU_LOPEZ_2000
from .antagonistic_inverse import TONIETTI_BICCHI2002, AntagonisticInverse


@model
class AngleAndStiffness(ControlLaw):
    """tau = tau_0(theta_r) + J a_r + K e + I - D omega,  I' = K/T_i e;  pressures by the inverse for tau and k_r.

    theta_r wanted angle, k_r wanted stiffness of the muscles (set point `stiffness`), e = theta_r - theta; tau_0 torque
    that holds the joint at rest, J a_r torque of the wanted acceleration where `acceleration_setpoint` names it; omega
    measured speed where D is not 0. The commands are two pressures, the set points of pressure regulators or, in a
    `Cascade`, of inner pressure controllers. I is limited to `max_integral`. The stiffness is controlled in open loop.
    References: Tondu and Lopez (2000), Tonietti and Bicchi (2002).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000, TONIETTI_BICCHI2002)

    inverse: AntagonisticInverse
    commanded: tuple[str, ...]
    gain: float = parameter("N m/rad", "K", "proportional gain", bounds=(0.0, 1e6), default=0.0)
    integral_time: float = parameter("s", "T_i", "integral time; 0: no integral", bounds=(0.0, 1e6), default=0.0)
    speed_gain: float = parameter("N m s/rad", "D", "gain of the measured speed", bounds=(0.0, 1e6), default=0.0)
    max_integral: float = parameter("N m", "I_max", "limit of the integral", bounds=(0.0, 1e6), default=100.0)
    speed_column: str = ""
    acceleration_setpoint: str = ""

    initial_memory: ClassVar[Mapping[str, float]] = {"integral": 0.0}

    def check(self) -> None:
        if len(self.commanded) != 2:
            raise ParameterError(
                f"AngleAndStiffness: {len(self.commanded)} commanded pressures; name two, such as ('left.pressure', "
                "'right.pressure')."
            )
        if self.speed_gain and not self.speed_column:
            raise ParameterError(
                "AngleAndStiffness: speed_gain needs speed_column, the measured speed, such as 'angular_speed'."
            )

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return (self.inverse.coordinate, *((self.speed_column,) if self.speed_column else ()))

    @property
    def setpoints(self) -> tuple[str, ...]:
        further = (self.acceleration_setpoint,) if self.acceleration_setpoint else ()
        return (self.inverse.coordinate, "stiffness", *further)

    @property
    def signal_units(self) -> dict[str, str]:
        acceleration = {self.acceleration_setpoint: "rad/s2"} if self.acceleration_setpoint else {}
        return {"stiffness": "N m/rad", **acceleration}

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.commanded

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        wanted, angle = measurement.setpoints, self.inverse.coordinate
        error = wanted[angle] - measurement.columns[angle]
        acceleration = wanted[self.acceleration_setpoint] if self.acceleration_setpoint else 0.0
        torque = self._torque_at(wanted[angle], acceleration) + self.gain * error + memory["integral"]
        if self.speed_column:
            torque = torque - self.speed_gain * measurement.columns[self.speed_column]
        first, second = self.inverse.pressures(wanted[angle], torque, wanted["stiffness"])
        integrates = self.integral_time > 0
        rate = self.gain / ops.where(integrates, self.integral_time, 1.0) * error
        integral = ops.clip(memory["integral"] + dt * rate, -self.max_integral, self.max_integral)
        later = {"integral": ops.where(integrates, integral, memory["integral"])}
        return dict(zip(self.commanded, (first, second), strict=True)), later

    def _torque_at(self, angle: Value, acceleration: Value) -> Value:
        """Torque of the muscles [N m] for an acceleration [rad/s2] from rest at an angle [rad]."""
        mechanism, name = self.inverse.mechanism, self.inverse.coordinate
        speed = mechanism.coordinates[0].speed
        inputs = {each.name: 0.0 for each in mechanism.inputs}
        free, driven = (
            mechanism.acceleration({name: angle}, {speed: 0.0}, {name: torque}, inputs)[name] for torque in (0.0, 1.0)
        )
        return (acceleration - free) / (driven - free)
