"""Which rows show the muscle at rest or moving slowly, and which a transient.

A row is quasi-static where the pressure, and the length where it is measured, change within the time `settling` by
no more than `change` of their range, or than the noise explains. Both numbers are chosen: 0.1 s is what a muscle of
ordinary size takes to follow its pressure, one in a hundred is what a static fit does not see.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .sampling import count_rows
from .sensor import Sensor, estimate_sensors
from .interval import Mask

SETTLING_TIME = 0.1
MAX_CHANGE = 0.01
_MONITORED = ("pressure", "contraction", "length", "position")


def quasi_static_rows(
    recording: Recording,
    sensed: Mapping[str, Sensor] | None = None,
    *,
    settling: float = SETTLING_TIME,
    change: float = MAX_CHANGE,
) -> Mask:
    """By row, whether it is quasi-static. Without time, every row is taken as a settled point."""
    calm = np.ones(len(recording), dtype=bool)
    if "time" not in recording or len(recording) < 3:
        return calm
    time = recording["time"]
    width = count_rows(settling, time, 1)
    sensed = sensed or estimate_sensors(recording)
    for name in recording:
        if name.rpartition(".")[2] in _MONITORED and name in sensed:
            calm &= ~_is_changing(recording[name], width, change, sensed[name])
    return calm


def _is_changing(values: Array, width: int, change: float, sensor: Sensor) -> Mask:
    """Whether a value changes too much from `width` rows before, or to as many behind: settled is both."""
    allowed = max(change * float(np.ptp(values)), 4.0 * sensor.std)
    step = np.abs(values[width:] - values[:-width]) if width < len(values) else np.empty(0)
    moves = np.zeros(len(values), dtype=bool)
    moves[: len(step)] |= step > allowed
    moves[width:] |= step > allowed
    return moves
