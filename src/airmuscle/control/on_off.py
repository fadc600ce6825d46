"""On or off: the two-point controller with hysteresis."""

from __future__ import annotations

from typing import ClassVar

from ..core.declaration import model, parameter
from ..core.reference import Reference
from .controller import Measurement
from .pid import ASTROM_HAGGLUND1995
from .siso import SisoController
from .split_range import Commanded, commands, range_of


@model
class OnOffController(SisoController):
    """The greatest command from y < r - H/2 on, the least from y > r + H/2 on, and the last one in between.

    r set point, y measurement, H width of the hysteresis. For an input that raises what is measured; it begins with
    the least command. With Split it fills, or else discharges. What it measures swings by more than H: valve, air and
    load go on after a switching, and it looks at samples only.
    Reference: Åström and Hägglund (1995), chapter 3, on-off control.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    measured: str
    commanded: Commanded
    hysteresis: float = parameter(
        "y", "H", "width between switching on and off", bounds=(0.0, float("inf")), default=0.0
    )

    def init(self) -> bool:
        """Off."""
        return False

    def step(self, memory: bool, measurement: Measurement, dt: float) -> tuple[dict[str, float], bool]:
        above = measurement.columns[self.measured] - measurement.setpoints[self.measured]
        on = above < -self.hysteresis / 2 or (memory and not above > self.hysteresis / 2)
        least, greatest = range_of(self.commanded, measurement.ranges)
        return commands(self.commanded, greatest if on else least), on
