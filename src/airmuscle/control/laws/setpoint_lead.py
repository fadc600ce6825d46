"""SetpointLead: control law whose command is a set point, advanced by a lead time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from .open_loop_law import OpenLoopLaw
from .pid import ASTROM_HAGGLUND1995


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

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.commanded,)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {self.commanded: self.share * (setpoints[self.signal] + self.lead_time * setpoints[self.rate])}
