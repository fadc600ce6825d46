"""WithFeedForward: the sum of the commands of a feed-forward and a feedback control law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, united, with_prefix
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.controller import Measurement
from .pid import ASTROM_HAGGLUND1995


@model
class WithFeedForward(ControlLaw):
    """u = u_ff + u_fb: each input receives the sum of the commands of two control laws.

    The feedback law sees the range of each input less the feed-forward command, so that its anti-windup is that of the
    sum. It commands no input that the feed-forward law does not command. The initial output of a PID remains 0: the
    first command is that of the feed-forward.
    Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    feed_forward: ControlLaw
    feedback: ControlLaw

    def check(self) -> None:
        other = [name for name in self.feedback.inputs if name not in self.feed_forward.inputs]
        if other:
            raise ParameterError(
                f"WithFeedForward: the feedback commands '{other[0]}'; the feed-forward law commands "
                f"{', '.join(self.feed_forward.inputs)}. Both must command the same inputs."
            )

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(self.feedback.measured_columns, self.feed_forward.measured_columns)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return united(self.feedback.setpoints, self.feed_forward.setpoints)

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.feed_forward.inputs

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of both laws, with the prefixes `feed_forward.` and `feedback.`."""
        parts = ("feed_forward", self.feed_forward), ("feedback", self.feedback)
        return {
            name: value
            for prefix, law in parts
            for name, value in with_prefix(f"{prefix}.", law.initial_memory).items()
        }

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        ahead, first = self.feed_forward.step(select_prefix("feed_forward.", memory), measurement, dt)
        ranges = {
            name: tuple(limit - ahead[name] for limit in measurement.ranges[name]) for name in self.feedback.inputs
        }
        back, second = self.feedback.step(select_prefix("feedback.", memory), measurement._replace(ranges=ranges), dt)
        commands = {name: value + back[name] if name in back else value for name, value in ahead.items()}
        return commands, {**with_prefix("feed_forward.", first), **with_prefix("feedback.", second)}
