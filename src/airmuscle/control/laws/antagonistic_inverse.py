"""AntagonisticInverse: the two pressures for a wanted torque and stiffness of an antagonistic joint."""

from __future__ import annotations

from typing import ClassVar

from ...core import autodiff, ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...physics.mechanism.base import Mechanism
from ...physics.muscle.characteristic.tondu_lopez2000 import TONDU_LOPEZ_2000
from ...physics.muscle.muscle import Muscle
from .static_inverse import check_invertible, pressure_between, static_force

TONIETTI_BICCHI2002 = Reference(
    key="tonietti-bicchi-2002",
    authors="Tonietti, G., Bicchi, A.",
    title="Adaptive simultaneous position and stiffness control for a soft robot arm",
    where="IEEE/RSJ International Conference on Intelligent Robots and Systems, Lausanne",
    year=2002,
    note="simultaneous control of angle and stiffness by two pneumatic muscles",
)


SLACK_STEPS = 6
"""Steps of the static inverse at the minimum tension."""


@model
class AntagonisticInverse:
    """Pressures (p_1, p_2) with tau(p_1, p_2, theta) = tau_r and -d tau/d theta = k_r at constant pressure.

    tau torque of both muscles on the joint, from their static tensions and the moment arms of the mechanism; k_r does
    not include the stiffness of a weight. The mean of the pressures determines the stiffness, their difference the
    torque. Both equations are solved by n Newton steps from the middle of the range p_min to p_max; one step is exact
    for tensions that are affine in the pressure. No muscle is slack: each pressure is at least that of the tension
    F_min. Where a pressure leaves its range it is limited, and the other one gives the torque as far as it can: torque
    has priority over stiffness.
    References: Tondu and Lopez (2000), Tonietti and Bicchi (2002).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000, TONIETTI_BICCHI2002)

    muscles: tuple[Muscle, ...]
    mechanism: Mechanism
    min_pressure: float = parameter(
        "Pa", "p_min", "minimum gauge pressure of both muscles", bounds=(-1e5, 1e7), fitted=False, default=0.0
    )
    max_pressure: float = parameter(
        "Pa", "p_max", "maximum gauge pressure of both muscles", bounds=(1.0, 1e7), fitted=False, default=6e5
    )
    min_tension: float = parameter(
        "N", "F_min", "minimum tension of both muscles (default chosen)", bounds=(0.0, 1e4), fitted=False, default=5.0
    )
    steps: int = 4

    def check(self) -> None:
        coordinates = self.mechanism.coordinates
        if len(self.muscles) != 2 or len(coordinates) != 1:
            raise ParameterError(
                f"AntagonisticInverse: {len(self.muscles)} muscles and {len(coordinates)} coordinates; it needs two "
                "muscles and one joint angle."
            )
        if self.min_pressure >= self.max_pressure:
            raise ParameterError(
                f"AntagonisticInverse: min_pressure is {self.min_pressure:g} Pa; allowed range: below max_pressure, "
                f"{self.max_pressure:g} Pa."
            )
        if not 1 <= self.steps <= 20:
            raise ParameterError(f"AntagonisticInverse: steps is {self.steps}; allowed range: 1 to 20.")
        for muscle in self.muscles:
            check_invertible("AntagonisticInverse", muscle)

    @property
    def coordinate(self) -> str:
        """The name of the joint angle."""
        return self.mechanism.coordinates[0].name

    def torque(self, first: Value, second: Value, angle: Value) -> Value:
        """Torque of both muscles [N m] at gauge pressures [Pa] and an angle [rad]."""
        lengths = [muscle.geometry.resting_length for muscle in self.muscles]
        q = {self.coordinate: angle}
        contractions = self.mechanism.contractions(q, lengths)
        tensions = [
            static_force(muscle, p, c) for muscle, p, c in zip(self.muscles, (first, second), contractions, strict=True)
        ]
        return self.mechanism.generalised_forces(q, tensions, lengths)[self.coordinate]

    def stiffness(self, first: Value, second: Value, angle: Value) -> Value:
        """Stiffness of both muscles -d tau/d theta [N m/rad] at constant pressures [Pa] and an angle [rad]."""
        return -autodiff.derivative(self, "torque", first, second, angle, wrt=2)

    def slack_limits(self, angle: Value) -> tuple[Value, Value]:
        """Lowest gauge pressures [Pa] at an angle [rad] at which the muscles have their minimum tension."""
        lengths = [muscle.geometry.resting_length for muscle in self.muscles]
        contractions = self.mechanism.contractions({self.coordinate: angle}, lengths)
        first, second = (
            pressure_between(self.min_pressure, self.max_pressure, muscle, c, self.min_tension, SLACK_STEPS)
            for muscle, c in zip(self.muscles, contractions, strict=True)
        )
        return first, second

    def pressures(self, angle: Value, torque: Value, stiffness: Value) -> tuple[Value, Value]:
        """Gauge pressures [Pa] of both muscles at an angle [rad] for a torque [N m] and a stiffness [N m/rad]."""
        high = self.max_pressure
        low_first, low_second = self.slack_limits(angle)
        first = second = 0.5 * (self.min_pressure + high)
        for _ in range(self.steps):
            missing_torque = torque - self.torque(first, second, angle)
            missing_stiffness = stiffness - self.stiffness(first, second, angle)
            a, b = (autodiff.derivative(self, "torque", first, second, angle, wrt=i) for i in (0, 1))
            c, d = (autodiff.derivative(self, "stiffness", first, second, angle, wrt=i) for i in (0, 1))
            determinant = a * d - b * c
            determinant = ops.where(determinant == 0.0, 1.0, determinant)
            first = first + (d * missing_torque - b * missing_stiffness) / determinant
            second = second + (a * missing_stiffness - c * missing_torque) / determinant
        first, second = ops.clip(first, low_first, high), ops.clip(second, low_second, high)
        for _ in range(2):
            missing = torque - self.torque(first, second, angle)
            slope = autodiff.derivative(self, "torque", first, second, angle, wrt=0)
            first = ops.clip(first + missing / slope, low_first, high)
            missing = torque - self.torque(first, second, angle)
            slope = autodiff.derivative(self, "torque", first, second, angle, wrt=1)
            second = ops.clip(second + missing / slope, low_second, high)
        return first, second
