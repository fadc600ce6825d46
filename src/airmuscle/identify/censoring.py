"""Points that say only on which side of them the truth lies: a slack muscle, a sensor at its end."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic, ForceLaw
from ..recording import Recording
from ..recording.segment import estimate_sensors
from .weights import sensor_deviations


@dataclasses.dataclass(frozen=True)
class Censoring:
    """The range of force [N] within which a point was measured; at its ends, and beyond, it was cut off.

    A row at or below `min_force` says that the muscle, could it push, would give this much or less; a row at
    or above `max_force` that it would give this much or more. A fit counts such a row only where the law
    contradicts it. Give the resolution of the sensor as `min_force` where slack rows read a little more than 0.
    """

    min_force: float = 0.0
    max_force: float = math.inf

    def signs(self, force: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """By row: 0 measured, 1 cut off below (the truth is less), -1 cut off above."""
        return (force <= self.min_force) * 1.0 - (force >= self.max_force) * 1.0


UNCENSORED = Censoring(-math.inf, math.inf)
"""Every row is fitted as it stands."""


def default_censoring(law: Characteristic) -> Censoring:
    """What a fit assumes: the range that a law in force is clamped to, from zero where it has none.

    Laws in contraction or pressure come from hung loads, of which zero is one like any other: nothing is cut off.
    """
    if not isinstance(law, ForceLaw):
        return UNCENSORED
    return Censoring(getattr(law, "min_force", 0.0), getattr(law, "max_force", math.inf))


def narrow_to_sensor(censoring: Censoring, law: Characteristic, runs: Sequence[Recording]) -> Censoring:
    """The range narrowed to what the force sensor of the runs can read, where it shows an end at which it is cut off.

    Told only where all runs state their time and come from one rig; laws in force alone, which can use a bound.
    """
    timed = bool(runs) and all("time" in run.columns and "force" in run.columns and len(run) for run in runs)
    if not isinstance(law, ForceLaw) or not timed or sensor_deviations(runs, "force") is not None:
        return censoring
    sensor = estimate_sensors(runs)["force"]
    near = 0.25 * sensor.resolution
    return Censoring(
        max(censoring.min_force, sensor.lower_limit + near), min(censoring.max_force, sensor.upper_limit - near)
    )
