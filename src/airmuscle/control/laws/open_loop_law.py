"""OpenLoopLaw (base): a control law that computes its commands from the set points alone."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from ...core.ops import Value
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.controller import Measurement


class OpenLoopLaw(ControlLaw):
    """A control law that measures nothing and stores nothing: feed-forward, or a distribution of set points."""

    initial_memory: ClassVar[Mapping[str, float]] = {}

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return ()

    @abc.abstractmethod
    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        """The command of every input [SI], from the set points by name."""

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        return self.command(measurement.setpoints), {}
