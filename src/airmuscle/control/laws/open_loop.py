"""Open-loop laws, whose commands follow from set points alone, and the static inverse of a
muscle.
"""

import abc
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core import (
    Parameter,
    ParameterError,
    Reference,
    Value,
    model,
    ops,
    parameter,
    published,
    within,
)
from ...engine.loop import ControlLaw, Measurement, Memory, Sampled, named_in
from ...physics import ElasticSeriesElement, ForceLaw, Muscle
from ...physics.muscle.characteristic.beyond_range import ForceRange, unlimited_force
from ...physics.muscle.geometry.meridian import SAGA_2007
from .pid_and_sliding_mode import ASTROM_HAGGLUND1995


class OpenLoopLaw(ControlLaw):
    """A control law that measures nothing and stores nothing: feed-forward, or a distribution of
    set points.
    """

    initial_memory: ClassVar[Mapping[str, float]] = {}
    measured_columns: ClassVar[tuple[str, ...]] = ()

    @abc.abstractmethod
    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        """The command of every input [SI], from the set points by name."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        return self.command(measurement.setpoints), {}


@model
class SetpointCommand(OpenLoopLaw):
    """u = r: the command of each input is a set point, such as a learned or precomputed
    feed-forward signal.

    setpoint_names and commanded have the same length and order; without setpoint_names they are the
    inputs' names.
    """

    commanded: tuple[str, ...]
    setpoint_names: tuple[str, ...] = ()

    def check(self) -> None:
        if self.setpoint_names and len(self.setpoint_names) != len(self.commanded):
            raise ParameterError(
                f"SetpointCommand: {len(self.setpoint_names)} set points for {len(self.commanded)}"
                " inputs; give one set point for each input."
            )

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.setpoint_names or self.commanded

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {
            name: setpoints[point]
            for name, point in zip(self.commanded, self.setpoints, strict=True)
        }


def check_pair(law: ControlLaw, commanded: tuple[str, ...]) -> None:
    """Raise ParameterError where a law of two antagonistic pressures does not command two."""
    if len(commanded) != 2:
        raise ParameterError(
            f"{type(law).__name__}: {len(commanded)} commanded pressures; name two, such as"
            " ('left.pressure', 'right.pressure')."
        )


@model
class SetpointLead(OpenLoopLaw):
    """u = K_f (r + T r').

    r and r' set points of a feed-forward signal and of its rate, T lead time, which compensates to
    first order the dead time of the sensors and the lag of the actuators; K_f share of the signal
    that is applied. It is the feed-forward law of `WithFeedForward` for a signal that is computed
    beforehand. Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    signal: str
    rate: str
    commanded: str
    lead_time: float = parameter("s", "T", "lead time", bounds=(0.0, 1e3), default=0.0)
    share: float = parameter("1", "K_f", "share of the signal", bounds=(0.0, 10.0), default=1.0)

    setpoints = named_in("signal", "rate")

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {
            self.commanded: (
                self.share * (setpoints[self.signal] + self.lead_time * setpoints[self.rate])
            )
        }


@model
class MotionFeedForward(OpenLoopLaw):
    """u = K_s r + K_v v_r + K_a a_r.

    r, v_r and a_r set points of the position, speed and acceleration of a wanted motion; K_s, K_v
    and K_a the stiffness, damping and inertia that another feed-forward lacks, or has too much of,
    in units of the command. It is added to that of a model by `WithFeedForward`. Without a name in
    `position`, K_s is not used. Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    speed: str
    acceleration: str
    commanded: str
    speed_gain: float = parameter(
        "SI", "K_v", "command by the speed", bounds=(-1e12, 1e12), default=0.0
    )
    acceleration_gain: float = parameter(
        "SI", "K_a", "command by the acceleration", bounds=(-1e12, 1e12), default=0.0
    )
    position_gain: float = parameter(
        "SI", "K_s", "command by the position", bounds=(-1e12, 1e12), default=0.0
    )
    position: str = ""

    setpoints = named_in("speed", "acceleration", optional=("position",))

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        motion = (
            self.speed_gain * setpoints[self.speed]
            + self.acceleration_gain * setpoints[self.acceleration]
        )
        if self.position:
            motion = motion + self.position_gain * setpoints[self.position]
        return {self.commanded: motion}


@model
class FrictionFeedForward(OpenLoopLaw):
    """u = A clip(v_r/v_0, -1, 1).

    v_r set point of the speed of a wanted motion, A command that balances Coulomb friction, v_0
    speed below which the command is proportional to the speed, so that it does not jump at a
    reversal. It is the feed-forward law of `WithFeedForward` beside that of the model without
    friction. Reference: Armstrong-Hélouvry, Dupont and Canudas de Wit (1994).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("armstrong-1994"),)

    speed: str
    commanded: str
    amplitude: float = parameter("u", "A", "command that balances the friction", bounds=(0.0, 1e9))
    boundary_speed: float = parameter(
        "SI", "v_0", "speed from which on it is constant", bounds=(1e-9, 1e9)
    )

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a parameter; that of v_0 is that of the speed."""
        if declared.name == "boundary_speed":
            return units[self.speed] or "1"
        return super().unit_of(declared, index, units)

    setpoints = named_in("speed")

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {
            self.commanded: (
                self.amplitude * ops.clip(setpoints[self.speed] / self.boundary_speed, -1.0, 1.0)
            )
        }


@model
class StaticInverse:
    """Static inverse p(eps, F): the gauge pressure with F_0(p, eps) = F, limited to p_min to p_max.

    F_0 is the force law without its limits, or the static force of a muscle (contractile element,
    parallel spring, end stop). Beyond the contractions of its range it is that of a stretched or of
    a slack muscle, as in a plant; a law alone has its own range, a muscle that of its file. F_0
    must increase with p. The root is found by n steps of the secant
    method of Anderson and Björck between p_min and p_max, so that the inverse is an expression that
    can be compiled. One step is exact for a law that is affine in p. For n = 10 the force at the
    returned pressure differs from F by less than 1e-9 of the force range for the laws of this
    package (tested). A force that no pressure in the range produces gives the nearer limit.

    A characteristic that is not a traceable force law is approximated first: `as_force_law(law,
    validity_range)`. Its estimated `max_error` [N] divided by dF/dp estimates the maximum error of
    the inverse [Pa]. A muscle with a series spring is refused. References: Saga et al. (2007) for
    the purpose; Anderson and Björck (1973) for the root.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007, published("anderson-bjorck-1973"))

    law: ForceLaw | Muscle
    min_pressure: float = parameter(
        "Pa",
        "p_min",
        "minimum gauge pressure of the inverse",
        bounds=(-1e5, 1e7),
        fitted=False,
        default=0.0,
    )
    max_pressure: float = parameter(
        "Pa",
        "p_max",
        "maximum gauge pressure of the inverse",
        bounds=(1.0, 1e7),
        fitted=False,
        default=6e5,
    )
    steps: int = within(1, 40, default=10)

    def check(self) -> None:
        check_invertible("StaticInverse", self.law)

    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N] that is inverted, at a gauge pressure [Pa] and a contraction [1]; arrays
        broadcast.
        """
        return static_force(self.law, pressure, contraction)

    def pressure(self, contraction: Value, force: Value) -> Value:
        """Gauge pressure [Pa] at a contraction [1] and a tension [N]; arrays broadcast."""
        with np.errstate(
            over="ignore", invalid="ignore"
        ):  # beyond the range of tensions, where no iterate is used
            return pressure_between(
                self.min_pressure, self.max_pressure, self.law, contraction, force, self.steps
            )


def pressure_between(
    low: Value, high: Value, law: ForceLaw | Muscle, contraction: Value, force: Value, steps: int
) -> Value:
    """Gauge pressure [Pa] from `low` to `high` at which a law has a tension [N] at a contraction
    [1].
    """
    at_low, at_high = (static_force(law, p, contraction) - force for p in (low, high))
    a = low
    b = high
    at_a = at_low
    at_b = at_high
    for _ in range(steps):
        difference = at_b - at_a
        c = b - at_b * (b - a) / ops.where(difference == 0.0, 1.0, difference)
        at_c = static_force(law, c, contraction) - force
        crossed = at_c * at_b < 0.0
        share = 1.0 - at_c / ops.where(at_b == 0.0, 1.0, at_b)
        a = ops.where(crossed, b, a)
        at_a = ops.where(crossed, at_b, at_a * ops.where(share > 0.0, share, 0.5))
        b = c
        at_b = at_c
    return ops.where(at_low >= 0.0, low, ops.where(at_high <= 0.0, high, b))


def static_force(law: ForceLaw | Muscle, pressure: Value, contraction: Value) -> Value:
    """Static tension [N] without limits at a gauge pressure [Pa] and a contraction [1]; beyond the
    range of the muscle, or that of a law itself, it is continued as in a plant.
    """
    if isinstance(law, Muscle):
        return law.unlimited_static_force(pressure, contraction)
    return unlimited_force(law, ForceRange.of(law), pressure, contraction)


def check_invertible(owner: str, law: ForceLaw | Muscle) -> None:
    """Raise ParameterError for a law that cannot be traced, or a muscle with a series spring."""
    contractile = law.contractile if isinstance(law, Muscle) else law
    if not contractile.traceable:
        raise ParameterError(
            f"{owner}: {type(contractile).__name__} has no closed form. Approximate it first: "
            "as_force_law(law, ValidityRange(...)) estimates its error."
        )
    if isinstance(law, Muscle) and isinstance(law.series, ElasticSeriesElement):
        raise ParameterError(
            f"{owner}: the muscle has a series spring, whose stretch the inverse does not contain."
            " Give the muscle without it, replace(muscle, series=RigidSeriesElement())."
        )


@model
class StaticFeedForward(OpenLoopLaw):
    """u = p(eps_0 + x_r/L_0, F_r + m a_r): the pressure of the static inverse for the wanted
    position and load.

    x_r set point of the position, F_r wanted load: a set point where `load_setpoint` names one,
    else the parameter `load`; a_r set point of the acceleration where `acceleration_setpoint` names
    one. Nothing is measured. The input is a pressure: the set point of a pressure regulator, or
    that of an inner pressure controller (`Cascade`). Beside feedback it is used in
    `WithFeedForward`. Friction, heat and the pressure's delay are not compensated. Reference: Saga
    et al. (2007), whose static model is meant for feed-forward control.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007,)

    inverse: StaticInverse
    commanded: str
    resting_length: float = parameter(
        "m", "L_0", "resting length of the muscle", bounds=(1e-3, 100.0)
    )
    load: float = parameter(
        "N", "F_r", "wanted load where it is no set point", bounds=(-1e6, 1e6), default=0.0
    )
    mass: float = parameter(
        "kg", "m", "mass that follows the wanted acceleration", bounds=(0.0, 1e6), default=0.0
    )
    offset: float = parameter(
        "1", "eps_0", "contraction at position 0", bounds=(-0.5, 0.9), default=0.0
    )
    position: str = "position"
    load_setpoint: str = ""
    acceleration_setpoint: str = ""

    setpoints = named_in("position", optional=("load_setpoint", "acceleration_setpoint"))

    @property
    def signal_units(self) -> dict[str, str]:
        named = {self.load_setpoint: "N", self.acceleration_setpoint: "m/s2"}
        return {name: unit for name, unit in named.items() if name}

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        force = setpoints[self.load_setpoint] if self.load_setpoint else self.load
        if self.acceleration_setpoint:
            force = force + self.mass * setpoints[self.acceleration_setpoint]
        contraction = self.offset + setpoints[self.position] / self.resting_length
        return {self.commanded: self.inverse.pressure(contraction, force)}
