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
    """u = K_v v_r + K_a a_r.

    v_r and a_r set points of the speed and the acceleration of a wanted motion, K_v and K_a the damping and the inertia
    that another feed-forward lacks, or has too much of, in units of the command. It is added to that of a model by
    `WithFeedForward`.
    Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    speed: str
    acceleration: str
    commanded: str
    speed_gain: float = parameter("SI", "K_v", "command by the speed", bounds=(-1e12, 1e12), default=0.0)
    acceleration_gain: float = parameter("SI", "K_a", "command by the acceleration", bounds=(-1e12, 1e12), default=0.0)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.speed, self.acceleration)

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.commanded,)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        motion = self.speed_gain * setpoints[self.speed] + self.acceleration_gain * setpoints[self.acceleration]
        return {self.commanded: motion}
