"""MotionFeedForward: control law whose command is proportional to speed and acceleration of a wanted motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from .open_loop_law import OpenLoopLaw
from .pid import ASTROM_HAGGLUND1995


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

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.commanded,)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        motion = self.speed_gain * setpoints[self.speed] + self.acceleration_gain * setpoints[self.acceleration]
        if self.position:
            motion = motion + self.position_gain * setpoints[self.position]
        return {self.commanded: motion}
