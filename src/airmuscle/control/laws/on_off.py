"""On/off controllers: hysteresis, and a dead zone for two valves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import Commanded, SisoController, commands, range_of
from ...engine.loop.controller import Measurement
from .pid import ASTROM_HAGGLUND1995
from .sliding_mode import sliding_memory, sliding_variable


@model
class OnOffController(SisoController):
    """The maximum command from y < r - H/2 on, the minimum from y > r + H/2 on, unchanged in between.

    r set point, y measurement, H width of the hysteresis. For an input that raises the measured column; the first
    command is the minimum. With SplitRange it fills or discharges. The measured column oscillates by more than H:
    valve, air and load continue to move after a switching, and switching takes place at samples only.
    Reference: Åström and Hägglund (1995), chapter 3, on-off control.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    measured: str
    commanded: Commanded
    hysteresis: float = parameter(
        "y", "H", "width between switching on and off", bounds=(0.0, float("inf")), default=0.0
    )

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether the maximum is commanded (0 or 1)."""
        return {"on": 0.0}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        error = measurement.columns[self.measured] - measurement.setpoints[self.measured]
        half = self.hysteresis / 2
        on = ops.where(error < -half, 1.0, ops.where(error > half, 0.0, memory["on"]))
        minimum, maximum = range_of(self.commanded, measurement.ranges)
        return commands(self.commanded, ops.where(on > 0, maximum, minimum)), {"on": on}


@model
class DeadZoneController(SisoController):
    """Maximum command where s > Z, minimum where s < -Z, and zero once |s| < z Z;  s = e + T_s e',  e = r - y.

    With SplitRange it fills, discharges or closes both valves. Z half width of the dead zone, z share of it at which a
    valve closes again (hysteresis); T_s anticipates the motion during the delays of valve and air, so that the valve
    closes before the set point is reached. Within the dead zone nothing switches.
    Reference: Åström and Hägglund (1995), chapter 3, on-off control with dead zone.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    measured: str
    commanded: Commanded
    zone: float = parameter("y", "Z", "half width of the dead zone", bounds=(0.0, 1e9))
    release: float = parameter(
        "1", "z", "share of the dead zone at which a valve closes", bounds=(0.0, 1.0), default=0.5
    )
    lead_time: float = parameter("s", "T_s", "time by which the motion is anticipated", bounds=(0.0, 1e3), default=0.0)
    filter_time: float = parameter("s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0)

    def check(self) -> None:
        if isinstance(self.commanded, str):
            raise ParameterError(
                f"DeadZoneController: commanded is the single input '{self.commanded}'; it needs two, "
                "SplitRange('fill', 'discharge')."
            )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The position (-1, 0 or 1), whether it has started, the last error and its filtered derivative."""
        return {**sliding_memory(), "position": 0.0}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        error = measurement.setpoints[self.measured] - measurement.columns[self.measured]
        s, later = sliding_variable(memory, error, self.lead_time, self.filter_time, dt)
        inner = self.release * self.zone
        held = memory["position"]
        remains = ops.where(held > 0.0, s >= inner, ops.where(held < 0.0, s <= -inner, 0.0 > 1.0))
        position = ops.where(s > self.zone, 1.0, ops.where(s < -self.zone, -1.0, ops.where(remains, held, 0.0)))
        low, high = range_of(self.commanded, measurement.ranges)
        output = ops.where(position > 0.0, high, ops.where(position < 0.0, low, 0.0))
        return commands(self.commanded, output), {**later, "position": position}
