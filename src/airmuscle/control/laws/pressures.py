"""Laws of the pressures of a joint: co-contraction, their feedback, and the inverse for angle and
stiffness.
"""

from collections.abc import Mapping
from typing import ClassVar

from ...core import (
    ParameterError,
    Reference,
    Value,
    autodiff,
    model,
    ops,
    parameter,
    published,
    within,
)
from ...core.declaration import forwarded
from ...engine.loop import (
    Commanded,
    ControlLaw,
    Measurement,
    Memory,
    Sampled,
    commands,
    named_in,
    range_of,
)
from ...physics import Mechanism, Muscle
from ...physics.muscle.characteristic.tondu_lopez2000 import TONDU_LOPEZ_2000
from .open_loop import OpenLoopLaw, check_invertible, check_pair, pressure_between, static_force
from .pid_and_sliding_mode import ASTROM_HAGGLUND1995

DIFFERENCE = "difference"
"""Name of the set point that an outer controller commands: half the difference of both pressures
[Pa].
"""
TONIETTI_BICCHI2002 = published("tonietti-bicchi-2002")
UNREACHED = 0.01
"""Part of the torque that the pressures must miss for the integral to stop (chosen): above the
error of the inverse.
"""
SLACK_STEPS = 6
"""Steps of the static inverse at the minimum tension."""


@model
class CoContraction(OpenLoopLaw):
    """p_1 = p_0 + d,   p_2 = p_0 - d.

    d half the pressure difference, which turns the joint: the set point `difference`; p_0 mean
    pressure, which stiffens it: the set point that `mean_setpoint` names, else the parameter
    `mean`. In a `Cascade` an outer controller of the angle commands d, and the two pressures are
    the set points of regulators or of inner pressure controllers. Neither needs a model of the
    muscles. Reference: Tondu and Lopez (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000,)

    commanded: tuple[str, ...]
    mean: float = parameter(
        "Pa", "p_0", "mean gauge pressure where it is no set point", bounds=(0.0, 1e7), default=0.0
    )
    mean_setpoint: str = ""

    def check(self) -> None:
        check_pair(self, self.commanded)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (DIFFERENCE, *((self.mean_setpoint,) if self.mean_setpoint else ()))

    @property
    def signal_units(self) -> dict[str, str]:
        return {DIFFERENCE: "Pa", **({self.mean_setpoint: "Pa"} if self.mean_setpoint else {})}

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        mean = setpoints[self.mean_setpoint] if self.mean_setpoint else self.mean
        first, second = self.commanded
        return {first: mean + setpoints[DIFFERENCE], second: mean - setpoints[DIFFERENCE]}

    def attained(self, measurement: Measurement, commands: Mapping[str, Value]) -> dict[str, Value]:
        first, second = (
            ops.clip(commands[n], *measurement.ranges[n]) - commands[n] for n in self.commanded
        )
        return {
            **measurement.setpoints,
            DIFFERENCE: measurement.setpoints[DIFFERENCE] + 0.5 * (first - second),
        }


@model
class ProportionalFeedback(ControlLaw):
    """u_i = K (r_i - y_i), and u_i = 0 where |r_i - y_i| < z, for every controlled column.

    Inner pressure controller of several equal muscles: a muscle with valves integrates the flow, so
    that proportional action leaves no error at rest, and a common gain K is one parameter for
    tuning. z half width of a dead zone, which keeps on/off valves closed at rest. `commanded` has
    one input or split range for each column. Reference: Åström and Hägglund (1995), chapter 3.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    controlled: tuple[str, ...]
    commanded: tuple[Commanded, ...]
    gain: float = parameter("u/y", "K", "gain of all columns", bounds=(0.0, 1e6))
    zone: float = parameter("y", "z", "half width of the dead zone", bounds=(0.0, 1e9), default=0.0)

    initial_memory: ClassVar[Mapping[str, float]] = {}

    def check(self) -> None:
        if not len(self.controlled) == len(self.commanded) >= 1:
            raise ParameterError(
                f"ProportionalFeedback: {len(self.controlled)} columns and {len(self.commanded)}"
                " commanded inputs; give one input, or one SplitRange, for each column."
            )

    measured_columns = forwarded("controlled")
    setpoints = forwarded("controlled")

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        result: dict[str, Value] = {}
        for name, commanded in zip(self.controlled, self.commanded, strict=True):
            error = measurement.setpoints[name] - measurement.columns[name]
            low, high = range_of(commanded, measurement.ranges)
            wanted = ops.where(ops.absolute_value(error) < self.zone, 0.0, self.gain * error)
            result |= commands(commanded, ops.clip(wanted, low, high))
        return result, {}

    def attained(self, measurement: Measurement, commands: Mapping[str, Value]) -> dict[str, Value]:
        """The set points with which the commands just reach the ends of their ranges, where they
        are beyond.
        """
        result = dict(measurement.setpoints)
        gain = ops.maximum(self.gain, 1e-30)
        for name, commanded in zip(self.controlled, self.commanded, strict=True):
            y = measurement.columns[name]
            low, high = range_of(commanded, measurement.ranges)
            result[name] = ops.clip(result[name], y + low / gain, y + high / gain)
        return result


@model
class AntagonisticInverse:
    """Pressures (p_1, p_2) with tau(p_1, p_2, theta) = tau_r and -d tau/d theta = k_r at constant
    pressure.

    tau torque of both muscles on the joint, from their static tensions and the moment arms of the
    mechanism; k_r does not include the stiffness of a weight. The mean of the pressures determines
    the stiffness, their difference the torque. Both equations are solved by n Newton steps from the
    middle of the range p_min to p_max; one step is exact for tensions that are affine in the
    pressure. No muscle is slack: each pressure is at least that of the tension F_min. Where a
    pressure leaves its range it is limited, and the other one gives the torque as far as it can:
    torque has priority over stiffness. References: Tondu and Lopez (2000), Tonietti and Bicchi
    (2002).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000, TONIETTI_BICCHI2002)

    muscles: tuple[Muscle, ...]
    mechanism: Mechanism
    min_pressure: float = parameter(
        "Pa",
        "p_min",
        "minimum gauge pressure of both muscles",
        bounds=(-1e5, 1e7),
        fitted=False,
        default=0.0,
    )
    max_pressure: float = parameter(
        "Pa",
        "p_max",
        "maximum gauge pressure of both muscles",
        bounds=(1.0, 1e7),
        fitted=False,
        default=6e5,
    )
    min_tension: float = parameter(
        "N",
        "F_min",
        "minimum tension of both muscles (default chosen)",
        bounds=(0.0, 1e4),
        fitted=False,
        default=5.0,
    )
    steps: int = within(1, 20, default=4)

    def check(self) -> None:
        coordinates = self.mechanism.coordinates
        if len(self.muscles) != 2 or len(coordinates) != 1:
            raise ParameterError(
                f"AntagonisticInverse: {len(self.muscles)} muscles and {len(coordinates)}"
                " coordinates; it needs two muscles and one joint angle."
            )
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
        points = zip(
            self.muscles, (first, second), self.mechanism.contractions(q, lengths), strict=True
        )
        tensions = [
            static_force(muscle, pressure, contraction) for muscle, pressure, contraction in points
        ]
        return self.mechanism.generalised_forces(q, tensions, lengths)[self.coordinate]

    def stiffness(self, first: Value, second: Value, angle: Value) -> Value:
        """Stiffness of both muscles -d tau/d theta [N m/rad] at constant pressures [Pa] and an
        angle [rad].
        """
        return -autodiff.derivative(self, "torque", first, second, angle, wrt=2)

    def slack_limits(self, angle: Value) -> tuple[Value, Value]:
        """Lowest gauge pressures [Pa] at an angle [rad] at which the muscles have their minimum
        tension.
        """
        lengths = [muscle.geometry.resting_length for muscle in self.muscles]
        contractions = self.mechanism.contractions({self.coordinate: angle}, lengths)
        first, second = (
            pressure_between(
                self.min_pressure, self.max_pressure, muscle, c, self.min_tension, SLACK_STEPS
            )
            for muscle, c in zip(self.muscles, contractions, strict=True)
        )
        return first, second

    def pressures(self, angle: Value, torque: Value, stiffness: Value) -> tuple[Value, Value]:
        """Gauge pressures [Pa] of both muscles at an angle [rad] for a torque [N m] and a stiffness
        [N m/rad].
        """
        high = self.max_pressure
        low_first, low_second = self.slack_limits(angle)
        first = second = 0.5 * (self.min_pressure + high)
        for _ in range(self.steps):
            missing_torque = torque - self.torque(first, second, angle)
            missing_stiffness = stiffness - self.stiffness(first, second, angle)
            a, b = (
                autodiff.derivative(self, "torque", first, second, angle, wrt=i) for i in (0, 1)
            )
            c, d = (
                autodiff.derivative(self, "stiffness", first, second, angle, wrt=i) for i in (0, 1)
            )
            determinant = a * d - b * c
            determinant = ops.where(determinant == 0.0, 1.0, determinant)
            first = first + (d * missing_torque - b * missing_stiffness) / determinant
            second = second + (a * missing_stiffness - c * missing_torque) / determinant
        first = ops.clip(first, low_first, high)
        second = ops.clip(second, low_second, high)
        for _ in range(2):
            missing = torque - self.torque(first, second, angle)
            slope = autodiff.derivative(self, "torque", first, second, angle, wrt=0)
            first = ops.clip(first + missing / slope, low_first, high)
            missing = torque - self.torque(first, second, angle)
            slope = autodiff.derivative(self, "torque", first, second, angle, wrt=1)
            second = ops.clip(second + missing / slope, low_second, high)
        return first, second


@model
class AngleAndStiffness(ControlLaw):
    """tau = tau_0(theta_r) + J a_r + K e + I - D omega,  I' = K/T_i e;  pressures by the inverse
    for tau and k_r.

    theta_r wanted angle, k_r wanted stiffness of the muscles (set point `stiffness`), e = theta_r -
    theta; tau_0 torque that holds the joint at rest, J a_r torque of the wanted acceleration where
    `acceleration_setpoint` names it; omega measured speed where D is not 0. The commands are two
    pressures, the set points of pressure regulators or, in a `Cascade`, of inner pressure
    controllers. I is limited to `max_integral`, and does not grow where the pressures have reached
    the end of their range and do not give the torque. The stiffness is controlled in open loop.
    References: Tondu and Lopez (2000), Tonietti and Bicchi (2002).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000, TONIETTI_BICCHI2002)

    inverse: AntagonisticInverse
    commanded: tuple[str, ...]
    gain: float = parameter("N m/rad", "K", "proportional gain", bounds=(0.0, 1e6), default=0.0)
    integral_time: float = parameter(
        "s", "T_i", "integral time; 0: no integral", bounds=(0.0, 1e6), default=0.0
    )
    speed_gain: float = parameter(
        "N m s/rad", "D", "gain of the measured speed", bounds=(0.0, 1e6), default=0.0
    )
    max_integral: float = parameter(
        "N m", "I_max", "limit of the integral", bounds=(0.0, 1e6), default=100.0
    )
    speed_column: str = ""
    acceleration_setpoint: str = ""

    initial_memory: ClassVar[Mapping[str, float]] = {"integral": 0.0}

    def check(self) -> None:
        check_pair(self, self.commanded)
        if self.speed_gain and not self.speed_column:
            raise ParameterError(
                "AngleAndStiffness: speed_gain needs speed_column, such as 'angular_speed'."
            )

    measured_columns = named_in("inverse.coordinate", optional=("speed_column",))

    @property
    def setpoints(self) -> tuple[str, ...]:
        further = (self.acceleration_setpoint,) if self.acceleration_setpoint else ()
        return (self.inverse.coordinate, "stiffness", *further)

    @property
    def signal_units(self) -> dict[str, str]:
        acceleration = {self.acceleration_setpoint: "rad/s2"} if self.acceleration_setpoint else {}
        return {"stiffness": "N m/rad", **acceleration}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted = measurement.setpoints
        angle = self.inverse.coordinate
        error = wanted[angle] - measurement.columns[angle]
        acceleration = wanted[self.acceleration_setpoint] if self.acceleration_setpoint else 0.0
        mechanism = self.inverse.mechanism
        speed = self.inverse.mechanism.coordinates[0].speed
        needed = mechanism.driving_force({angle: wanted[angle]}, {speed: 0.0}, acceleration)
        torque = needed + self.gain * error + memory["integral"]
        if self.speed_column:
            torque = torque - self.speed_gain * measurement.columns[self.speed_column]
        first, second = self.inverse.pressures(wanted[angle], torque, wanted["stiffness"])
        integrates = self.integral_time > 0
        rate = self.gain / ops.where(integrates, self.integral_time, 1.0) * error
        missing = torque - self.inverse.torque(first, second, wanted[angle])
        # with the same sign, the integral would ask for still more of what the pressures cannot
        # give
        held = ops.where(
            missing * rate > 0.0,
            ops.where(missing * missing > (UNREACHED * torque) ** 2, 1.0, 0.0),
            0.0,
        )
        integral = memory["integral"] + dt * ops.where(held > 0.5, 0.0, rate)
        integral = ops.clip(integral, -self.max_integral, self.max_integral)
        later = {"integral": ops.where(integrates, integral, memory["integral"])}
        return dict(zip(self.commanded, (first, second), strict=True)), later
