"""Antagonistic joint: two muscles that rotate a joint in opposite directions."""

from collections.abc import Sequence

from ...core import ParameterError, Value, Values, check_structure, model, ops, parameter
from .base import Coordinate, Mechanism
from .pulley_profile import ConstantRadius, PulleyProfile, check_profile


@model
class AntagonisticJoint(Mechanism):
    """Antagonistic joint: J theta'' = r_1 F_1 - r_2 F_2 - M sin(theta + theta_g) - b theta'.

        r_1 = r f(theta),                   r_2 = r f(-theta)
        eps_1 = eps_0 + r F(theta)/L0_1,    eps_2 = eps_0 + r F(-theta)/L0_2,    F(theta) = integral of f from 0

    theta joint angle; the first muscle increases it, the second decreases it. r radius of both pulleys at theta = 0, f
    their profile, mirrored for the second muscle (f = 1 for circular pulleys), eps_0 contraction of both at theta = 0,
    J inertia, b viscous friction, M = m g l torque of the weight where it is horizontal, theta_g angle of the weight
    from its hanging position at theta = 0 (0 for a hanging pendulum, pi/2 for a forearm that is horizontal at 0).
    A negative M describes an inverted pendulum. `min_angle` and `max_angle` are the range of angles in which equilibria
    are searched; they are not end stops (JointWithEndStops).
    """

    radius: float = parameter("m", "r", "pulley radius of both muscles at angle 0", bounds=(1e-3, 1.0))
    inertia: float = parameter("kg m^2", "J", "moment of inertia about the joint axis", bounds=(1e-6, 1e4))
    damping: float = parameter("N m s/rad", "b", "viscous friction of the joint", bounds=(0.0, 1e4), default=0.0)
    weight_torque: float = parameter(
        "N m", "M", "torque of the weight where it is horizontal", bounds=(-1e5, 1e5), default=0.0
    )
    offset: float = parameter("1", "eps_0", "contraction of both muscles at angle 0", bounds=(-0.5, 0.9), default=0.0)
    weight_angle: float = parameter(
        "rad", "theta_g", "angle of the weight from its hanging position at angle 0", bounds=(-10.0, 10.0),
        fitted=False, default=0.0,
    )  # fmt: skip
    min_angle: float = parameter(
        "rad", "theta_min", "lower limit of the angle", bounds=(-10.0, 10.0), fitted=False, default=-ops.pi
    )
    max_angle: float = parameter(
        "rad", "theta_max", "upper limit of the angle", bounds=(-10.0, 10.0), fitted=False, default=ops.pi
    )
    profile: PulleyProfile = ConstantRadius()

    def check(self) -> None:
        check_structure(self)
        low, high = self.min_angle, self.max_angle
        if not low < high:
            raise ParameterError(f"AntagonisticJoint: min_angle is {low:g}; it must be less than max_angle, {high:g}.")
        reach = max(abs(low), abs(high))  # the profile of the second muscle is mirrored
        check_profile("AntagonisticJoint", self.profile, -reach, reach)

    @property
    def muscle_count(self) -> int | None:
        return 2

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("angle", "angular_speed", "rad", 0.1, 1.0, self.min_angle, self.max_angle),)

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        angle, (first, second) = q["angle"], resting_lengths
        return (
            self.offset + self.radius * self.profile.integral(angle) / first,
            self.offset + self.radius * self.profile.integral(-angle) / second,
        )

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        first, second = (self.profile.ratio(angle) for angle in (q["angle"], -q["angle"]))
        return {"angle": self.radius * (first * tensions[0] - second * tensions[1])}

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        weight = self.weight_torque * ops.sin(q["angle"] + self.weight_angle)
        return {"angle": (forces["angle"] - (weight + self.damping * v["angular_speed"])) / self.inertia}

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return self.damping * v["angular_speed"] ** 2

    def potential_energy(self, q: Values) -> Value:
        return self.weight_torque * (1.0 - ops.cos(q["angle"] + self.weight_angle))

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        return 0.5 * self.inertia * v["angular_speed"] ** 2
