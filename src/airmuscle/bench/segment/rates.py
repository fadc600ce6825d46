"""Rate of change of a recorded quantity, without the noise of its sensor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...recording.recording import Recording
from .sensor import estimate_sensors

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
