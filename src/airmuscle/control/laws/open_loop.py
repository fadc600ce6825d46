"""Open-loop laws, whose commands follow from set points alone: signals, lead, and feed-forward of a motion."""

import abc
from collections.abc import Mapping
from typing import ClassVar

from ...core import Parameter, ParameterError, Reference, Value, model, ops, parameter, published
from ...engine.loop import ControlLaw, Measurement, Memory, Sampled
from .pid import ASTROM_HAGGLUND1995


class OpenLoopLaw(ControlLaw):
    """A control law that measures nothing and stores nothing: feed-forward, or a distribution of set points."""

    initial_memory: ClassVar[Mapping[str, float]] = {}

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return ()

    @abc.abstractmethod
    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        """The command of every input [SI], from the set points by name."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        return self.command(measurement.setpoints), {}


@model
class SetpointCommand(OpenLoopLaw):
    """u = r: the command of each input is a set point, such as a learned or precomputed feed-forward signal.

    setpoint_names and commanded have the same length and order; without setpoint_names they are the inputs' names.
    """

    commanded: tuple[str, ...]
    setpoint_names: tuple[str, ...] = ()

    def check(self) -> None:
        if self.setpoint_names and len(self.setpoint_names) != len(self.commanded):
            raise ParameterError(
                f"SetpointCommand: {len(self.setpoint_names)} set points for {len(self.commanded)} inputs; give one "
                "set point for each input."
            )

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.setpoint_names or self.commanded

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {name: setpoints[point] for name, point in zip(self.commanded, self.setpoints, strict=True)}


def check_pair(law: ControlLaw, commanded: tuple[str, ...]) -> None:
    """Raise ParameterError where a law of two antagonistic pressures does not command two."""
    if len(commanded) != 2:
        raise ParameterError(
            f"{type(law).__name__}: {len(commanded)} commanded pressures; name two, such as ('left.pressure', "
            "'right.pressure')."
        )


@model
class SetpointLead(OpenLoopLaw):
    """u = K_f (r + T r').

    r and r' set points of a feed-forward signal and of its rate, T lead time, which compensates to first order the dead
    time of the sensors and the lag of the actuators; K_f share of the signal that is applied. It is the feed-forward
    law of `WithFeedForward` for a signal that is computed beforehand.
    Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    signal: str
    rate: str
    commanded: str
    lead_time: float = parameter("s", "T", "lead time", bounds=(0.0, 1e3), default=0.0)
    share: float = parameter("1", "K_f", "share of the signal", bounds=(0.0, 10.0), default=1.0)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.signal, self.rate)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {self.commanded: self.share * (setpoints[self.signal] + self.lead_time * setpoints[self.rate])}


@model
class MotionFeedForward(OpenLoopLaw):
    """u = K_s r + K_v v_r + K_a a_r.

    r, v_r and a_r set points of the position, speed and acceleration of a wanted motion; K_s, K_v and K_a the
    stiffness, damping and inertia that another feed-forward lacks, or has too much of, in units of the command. It is
    added to that of a model by `WithFeedForward`. Without a name in `position`, K_s is not used.
    Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    speed: str
    acceleration: str
    commanded: str
    speed_gain: float = parameter("SI", "K_v", "command by the speed", bounds=(-1e12, 1e12), default=0.0)
    acceleration_gain: float = parameter("SI", "K_a", "command by the acceleration", bounds=(-1e12, 1e12), default=0.0)
    position_gain: float = parameter("SI", "K_s", "command by the position", bounds=(-1e12, 1e12), default=0.0)
    position: str = ""

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.speed, self.acceleration, *((self.position,) if self.position else ()))

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        motion = self.speed_gain * setpoints[self.speed] + self.acceleration_gain * setpoints[self.acceleration]
        if self.position:
            motion = motion + self.position_gain * setpoints[self.position]
        return {self.commanded: motion}


@model
class FrictionFeedForward(OpenLoopLaw):
    """u = A clip(v_r/v_0, -1, 1).

    v_r set point of the speed of a wanted motion, A command that balances Coulomb friction, v_0 speed below which the
    command is proportional to the speed, so that it does not jump at a reversal. It is the feed-forward law of
    `WithFeedForward` beside that of the model without friction.
    Reference: Armstrong-Hélouvry, Dupont and Canudas de Wit (1994).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("armstrong-1994"),)

    speed: str
    commanded: str
    amplitude: float = parameter("u", "A", "command that balances the friction", bounds=(0.0, 1e9))
    boundary_speed: float = parameter("SI", "v_0", "speed from which on it is constant", bounds=(1e-9, 1e9))

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a parameter; that of v_0 is that of the speed."""
        if declared.name == "boundary_speed":
            return units[self.speed] or "1"
        return super().unit_of(declared, index, units)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.speed,)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {self.commanded: self.amplitude * ops.clip(setpoints[self.speed] / self.boundary_speed, -1.0, 1.0)}
