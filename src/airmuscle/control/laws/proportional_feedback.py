"""ProportionalFeedback: proportional control of several columns with one common gain and dead zone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import Commanded, ControlLaw, commands, inputs_of, range_of
from ...engine.loop.controller import Measurement
from .pid import ASTROM_HAGGLUND1995


@model
class ProportionalFeedback(ControlLaw):
    """u_i = K (r_i - y_i), and u_i = 0 where |r_i - y_i| < z, for every controlled column.

    Inner pressure controller of several equal muscles: a muscle with valves integrates the flow, so that proportional
    action leaves no error at rest, and a common gain K is one parameter for tuning. z half width of a dead zone, which
    keeps on/off valves closed at rest. `commanded` has one input or split range for each column.
    Reference: Åström and Hägglund (1995), chapter 3.
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
                f"ProportionalFeedback: {len(self.controlled)} columns and {len(self.commanded)} commanded inputs; "
                "give one input, or one SplitRange, for each column."
            )

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.controlled

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.controlled

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(name for each in self.commanded for name in inputs_of(each))

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        result: dict[str, Value] = {}
        for name, commanded in zip(self.controlled, self.commanded, strict=True):
            error = measurement.setpoints[name] - measurement.columns[name]
            low, high = range_of(commanded, measurement.ranges)
            wanted = ops.where(ops.absolute_value(error) < self.zone, 0.0, self.gain * error)
            result |= commands(commanded, ops.clip(wanted, low, high))
        return result, {}
