"""OnOffController: two-position control with hysteresis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import Commanded, SisoController, commands, range_of
from ...engine.loop.controller import Measurement
from .pid import ASTROM_HAGGLUND1995


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
