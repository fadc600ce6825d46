"""Censored observations: rows at zero force (slack muscle) or at the limit of the force sensor."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core.annotation import check_field_types
from ...physics.muscle.characteristic.base import Characteristic, ForceLaw
from ...recording import Recording
from ..segment import estimate_sensors
from .weights import sensor_deviations


@dataclasses.dataclass(frozen=True)
class Censoring:
    """The range of force [N] within which a row is a measured value; at its limits and beyond it is a bound.

    A row at or below `min_force` states that the force of the law is at most `min_force` there, since a slack muscle
    cannot push; a row at or above `max_force`, that it is at least `max_force`. Such a censored row contributes to the
    fit only where the law violates this bound. Set `min_force` to the resolution of the sensor where slack rows read
    slightly more than 0.
    """

    min_force: float = 0.0
    max_force: float = math.inf

    def __post_init__(self) -> None:
        check_field_types(self)

    def signs(self, force: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """By row: 0 uncensored, 1 censored below (the true force is at most the limit), -1 censored above."""
        return (force <= self.min_force) * 1.0 - (force >= self.max_force) * 1.0

    def within(self, other: Censoring) -> Censoring:
        """The range that both have in common."""
        return Censoring(max(self.min_force, other.min_force), min(self.max_force, other.max_force))


UNCENSORED = Censoring(-math.inf, math.inf)
"""No censoring: every row is a measured value."""


def default_censoring(law: Characteristic) -> Censoring:
    """The range of force to which a force law is clamped, from zero if it has no clamp.

    Laws that give contraction or pressure are measured with suspended loads, of which zero is an ordinary value: no
    row is censored.
    """
    if not isinstance(law, ForceLaw):
        return UNCENSORED
    return Censoring(getattr(law, "min_force", 0.0), getattr(law, "max_force", math.inf))


def force_limits(runs: Sequence[Recording]) -> Censoring:
    """The range of the force sensor, where the recordings show a limit at which it saturates.

    The limits are estimated only if every recording has a time column and all come from one test rig; otherwise the
    range is unlimited.
    """
    timed = bool(runs) and all("time" in run.columns and "force" in run.columns and len(run) for run in runs)
    if not timed or sensor_deviations(runs, "force") is not None:
        return UNCENSORED
    sensor = estimate_sensors([Recording({"force": run.columns["force"]}, run.origin) for run in runs])["force"]
    margin = 0.25 * sensor.resolution
    return Censoring(sensor.lower_limit + margin, sensor.upper_limit - margin)
