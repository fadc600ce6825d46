"""Quasi-static and transient rows, and the rate of change of a recorded quantity without the noise of its sensor.

A row is quasi-static if the pressure, and the length if measured, change within `settling_time` by at most the fraction
`max_change` of their range, or by no more than the noise explains. Both numbers are chosen: 0.1 s is the time in which
a muscle of usual size follows its pressure, and a change of 1 % is negligible for a static fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.arrays import Array
from ...recording.displacement import MOVED
from ...recording.recording import Recording
from .interval import Mask
from .sampling import count_rows
from .sensor import Sensor, estimate_sensors

SETTLING_TIME = 0.1
MAX_CHANGE = 0.01
NOISE_FACTOR = 5.7
"""A difference of two readings below this multiple of the standard deviation of the sensor is noise: four standard
deviations of the difference (chosen)."""
_MONITORED = ("pressure", *MOVED)


def quasi_static_rows(
    recording: Recording,
    sensors: Mapping[str, Sensor] | None = None,
    *,
    settling_time: float = SETTLING_TIME,
    max_change: float = MAX_CHANGE,
) -> Mask:
    """Whether each row is quasi-static (N,). Without time, every row is taken as a steady state."""
    quasi_static = np.ones(len(recording), dtype=bool)
    if "time" not in recording or len(recording) < 3:
        return quasi_static
    time = recording["time"]
    width = count_rows(settling_time, time, 1)
    sensors = sensors or estimate_sensors(recording)
    for name in recording:
        if name.rpartition(".")[2] in _MONITORED and name in sensors:
            quasi_static &= ~_is_changing(recording[name], width, max_change, sensors[name])
    return quasi_static


def _is_changing(values: Array, width: int, max_change: float, sensor: Sensor) -> Mask:
    """Whether a value changes by too much from `width` rows before, or to `width` rows after."""
    allowed = max(max_change * float(np.ptp(values)), NOISE_FACTOR * sensor.std)
    step = np.abs(values[width:] - values[:-width]) if width < len(values) else np.empty(0)
    changing = np.zeros(len(values), dtype=bool)
    changing[: len(step)] |= step > allowed
    changing[width:] |= step > allowed
    return changing


RATE_LEVEL = 0.95
"""Share of the rows that change at most at the stated rate (chosen)."""
MIN_CHANGE = 30.0
"""Minimum change over an interval of which a rate is computed, in standard deviations of the sensor (chosen)."""


def rate_of_change(recording: Recording, name: str) -> float:
    """The rate that 95 % of the rows do not exceed [SI per s]; 0 without time or where the quantity is constant.

    The interval is doubled from one row until the change within it exceeds the noise.
    """
    if "time" not in recording or name not in recording:
        return 0.0
    time, values = recording["time"], recording[name]
    sensor = estimate_sensors(recording).get(name)
    least, width = MIN_CHANGE * (sensor.std if sensor else 0.0), 1
    while width < len(recording):
        change, span = np.abs(values[width:] - values[:-width]), time[width:] - time[:-width]
        known = np.isfinite(change) & (span > 0.0)
        if not known.any():
            return 0.0
        if float(np.quantile(change[known], RATE_LEVEL)) > least:
            return float(np.quantile(change[known] / span[known], RATE_LEVEL))
        width *= 2
    return 0.0


def maximum_rate(recordings: Sequence[Recording], name: str) -> float:
    """The maximum over recordings of `rate_of_change` [SI per s]; 0 without any."""
    return max((rate_of_change(recording, name) for recording in recordings), default=0.0)
