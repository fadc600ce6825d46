"""Joints: a pair of muscles on pulleys, the profiles of these, and a lever with a mass."""

import abc
from collections.abc import Sequence

from ...core import ParameterError, Value, Values, model, ops, parameter
from ...core.declaration import forwarded
from .base import Coordinate, DampedCoordinate, angle_limit, gravity_parameter

SAMPLES = 101
"""Number of angles at which a profile is checked (chosen)."""


class PulleyProfile(abc.ABC):
    """Shape of a pulley (interface): moment arm r(theta) = r f(theta) with f(0) = 1.

    The muscle on it shortens by r F(theta), where F is the integral of f from 0, so that moment arm
    and length of the muscle belong together. r is the radius at angle 0, a parameter of the
    mechanism.
    """

    @abc.abstractmethod
    def ratio(self, angle: Value) -> Value:
        """Moment arm divided by that at angle 0, f [1], at an angle [rad]."""

    @abc.abstractmethod
    def integral(self, angle: Value) -> Value:
        """Integral F [rad] of the ratio from 0 to an angle [rad]."""


@model
class ConstantRadius(PulleyProfile):
    """Circular pulley about the joint axis: f = 1, F = theta."""

    def ratio(self, angle: Value) -> Value:
        return 1.0

    def integral(self, angle: Value) -> Value:
        return angle


@model
class PolynomialProfile(PulleyProfile):
    """Shaped pulley: f = 1 + c_1 theta + c_2 theta^2 + ..., F = theta + c_1 theta^2/2 + c_2
    theta^3/3 + ...
    """

    coefficients: tuple[float, ...] = parameter(
        "1", "c_k", "coefficient of the k-th power of the angle in radians", bounds=(-100.0, 100.0)
    )

    def check(self) -> None:
        if not self.coefficients:
            raise ParameterError(
                "PolynomialProfile: coefficients is empty; give at least one, or use ConstantRadius"
                " for a circular pulley."
            )

    def ratio(self, angle: Value) -> Value:
        total: Value = 0.0
        for coefficient in reversed(self.coefficients):
            total = angle * (coefficient + total)
        return 1.0 + total

    def integral(self, angle: Value) -> Value:
        total: Value = 0.0
        for k, coefficient in reversed(list(enumerate(self.coefficients, start=2))):
            total = angle * (coefficient / k + total)
        return angle * (1.0 + total)


@model
class CrankProfile(PulleyProfile):
    """Crank with a muscle that stays parallel to itself: f = cos(theta - theta_m)/cos theta_m.

    theta_m angle of the maximum moment arm. F = (sin(theta - theta_m) + sin theta_m)/cos theta_m.
    """

    maximum_angle: float = parameter(
        "rad", "theta_m", "angle of the maximum moment arm", bounds=(-1.5, 1.5), default=0.0
    )

    def ratio(self, angle: Value) -> Value:
        return ops.cos(angle - self.maximum_angle) / ops.cos(self.maximum_angle)

    def integral(self, angle: Value) -> Value:
        top = self.maximum_angle
        return (ops.sin(angle - top) + ops.sin(top)) / ops.cos(top)


@model
class AntagonisticJoint(DampedCoordinate):
    """Antagonistic joint: J theta'' = r_1 F_1 - r_2 F_2 - M sin(theta + theta_g) - b theta'.

        r_1 = r f(theta),                   r_2 = r f(-theta)
        eps_1 = eps_0 + r F(theta)/L0_1,    eps_2 = eps_0 + r F(-theta)/L0_2,    F(theta) = integral
                                            of f from 0

    theta joint angle; the first muscle increases it, the second decreases it. f profile of the
    pulleys, mirrored for the second muscle (f = 1 for circular pulleys), eps_0 contraction of both
    at theta = 0, M = m g l torque of the weight where it is horizontal, theta_g its angle from
    hanging at theta = 0 (0 for a hanging pendulum, pi/2 for a forearm that is horizontal at 0). A
    negative M describes an inverted pendulum. `min_angle` and `max_angle` are the range of angles
    in which equilibria are searched; they are not end stops (JointWithEndStops).
    """

    radius: float = parameter(
        "m", "r", "pulley radius of both muscles at angle 0", bounds=(1e-3, 1.0)
    )
    inertia: float = parameter(
        "kg m^2", "J", "moment of inertia about the joint axis", bounds=(1e-6, 1e4)
    )
    damping: float = parameter(
        "N m s/rad", "b", "viscous friction of the joint", bounds=(0.0, 1e4), default=0.0
    )
    weight_torque: float = parameter(
        "N m", "M", "torque of the weight where it is horizontal", bounds=(-1e5, 1e5), default=0.0
    )
    offset: float = parameter(
        "1", "eps_0", "contraction of both muscles at angle 0", bounds=(-0.5, 0.9), default=0.0
    )
    weight_angle: float = parameter(
        "rad",
        "theta_g",
        "angle of the weight from its hanging position at angle 0",
        bounds=(-10.0, 10.0),
        fitted=False,
        default=0.0,
    )
    min_angle: float = angle_limit("theta_min", "lower limit of the angle", -ops.pi)
    max_angle: float = angle_limit("theta_max", "upper limit of the angle", ops.pi)
    profile: PulleyProfile = ConstantRadius()

    def check(self) -> None:
        reach = max(
            abs(self.min_angle), abs(self.max_angle)
        )  # the profile of the second muscle is mirrored
        for k in range(SAMPLES):
            angle = -reach + k * (2 * reach / (SAMPLES - 1))
            ratio = self.profile.ratio(angle)
            if not ratio > 0.0:
                raise ParameterError(
                    f"AntagonisticJoint: the moment arm of its profile is {ratio:.3g} times that at"
                    f" angle 0 at {angle:.4g} rad; allowed range: greater than 0 from {-reach:.4g}"
                    f" to {reach:.4g} rad. Choose another profile, or a smaller range of angles."
                )

    muscle_count = 2
    total_inertia = forwarded("inertia")

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (
            Coordinate("angle", "angular_speed", "rad", 0.1, 1.0, self.min_angle, self.max_angle),
        )

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        sides = zip((q["angle"], -q["angle"]), resting_lengths, strict=True)
        return tuple(
            self.offset + self.radius * self.profile.integral(angle) / length
            for angle, length in sides
        )

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> Values:
        first, second = (self.profile.ratio(angle) for angle in (q["angle"], -q["angle"]))
        return {"angle": self.radius * (first * tensions[0] - second * tensions[1])}

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        weight = self.weight_torque * ops.sin(q["angle"] + self.weight_angle)
        return {
            "angle": (forces["angle"] - (weight + self.damping * v["angular_speed"])) / self.inertia
        }

    def potential_energy(self, q: Values) -> Value:
        return self.weight_torque * (1.0 - ops.cos(q["angle"] + self.weight_angle))


@model
class Lever(DampedCoordinate):
    """Lever: (J + m b^2) phi'' = sum F_i d(L0_i eps_i)/dphi - m g b cos phi - d phi'.

        eps_i = 1 - sqrt((a_i cos phi - a_i)^2 + (h_i - a_i sin phi)^2)/L0_i,   h_i = L0_i (1 -
            eps_0i)

    phi angle from the horizontal, a_i lever arm of muscle i, whose fixed end is vertically above
    its attachment point at phi = 0. A muscle on a negative arm acts in the opposite direction. J
    does not include the mass m of the load.
    """

    arms: tuple[float, ...] = parameter(
        "m", "a_i", "lever arm of each muscle", bounds=(-10.0, 10.0)
    )
    mass: float = parameter("kg", "m", "mass of the load", bounds=(0.0, 1e5))
    load_arm: float = parameter("m", "b", "lever arm of the load", bounds=(-10.0, 10.0))
    inertia: float = parameter(
        "kg m^2",
        "J",
        "moment of inertia of the lever without the load",
        bounds=(0.0, 1e4),
        default=0.0,
    )
    damping: float = parameter(
        "N m s/rad", "d", "viscous friction of the bearing", bounds=(0.0, 1e5), default=0.0
    )
    offsets: tuple[float, ...] = parameter(
        "1", "eps_0i", "contraction of each muscle at angle 0", bounds=(-0.5, 0.9), default=()
    )
    gravity: float = gravity_parameter()

    def check(self) -> None:
        if not self.arms or len(self.offsets) not in (0, len(self.arms)):
            raise ParameterError(
                f"Lever: {len(self.arms)} arms and {len(self.offsets)} offsets are given; give one"
                " arm for each muscle, and one offset for each or no offsets."
            )
        if not self.total_inertia > 0.0:
            raise ParameterError(
                "Lever: the total inertia is zero; give an inertia, or a mass with a load_arm."
            )

    @property
    def muscle_count(self) -> int | None:
        return len(self.arms)

    coordinates = (
        Coordinate("angle", "angular_speed", "rad", 0.05, 1.0, -0.5 * ops.pi, 0.5 * ops.pi),
    )

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        horizontal = ops.cos(q["angle"]) - 1.0
        vertical = ops.sin(q["angle"])
        offsets = self.offsets or (0.0,) * len(self.arms)
        contractions = []
        for arm, offset, length in zip(self.arms, offsets, resting_lengths, strict=True):
            height = length * (1.0 - offset)
            contractions.append(
                1.0 - ops.sqrt((arm * horizontal) ** 2 + (height - arm * vertical) ** 2) / length
            )
        return tuple(contractions)

    @property
    def total_inertia(self) -> Value:
        return self.inertia + self.mass * self.load_arm**2

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        weight = self.mass * self.gravity * self.load_arm * ops.cos(q["angle"])
        return {
            "angle": (
                (forces["angle"] - weight - self.damping * v["angular_speed"]) / self.total_inertia
            )
        }

    def potential_energy(self, q: Values) -> Value:
        return self.mass * self.gravity * self.load_arm * ops.sin(q["angle"])
