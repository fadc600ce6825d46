"""What a row weighs: the inverse of its sensor's standard deviation, where recordings come from several rigs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError
from ..recording import Recording
from ..recording.segment import estimate_sensors

MIN_SENSOR_RATIO = 2.0
"""Ratio of neighbouring deviations from which on two sensors differ (chosen: one sensor's estimates scatter less)."""


def sensor_deviations(runs: Sequence[Recording], quantity: str) -> Array | None:
    """The standard deviation [SI] of one reading in each recording; None where all readings weigh alike.

    Noise and rounding count where every recording states its time; else rounding alone, since the order of other rows
    is no history. Recordings whose deviations lie close together count as of one rig and share their median. None too
    where a sensor shows neither noise nor resolution.
    """
    timed = all("time" in run.columns for run in runs)
    each = []
    for run in runs:
        try:
            each.append(_sensor_deviation(run, quantity, timed))
        except ColumnError:
            return None
        if not each[-1] > 0:  # the others need not be looked at
            return None
    alone = np.array(each)
    order = np.argsort(alone)
    if not alone.size:
        return None
    rigs = np.split(order, np.flatnonzero(alone[order][1:] > MIN_SENSOR_RATIO * alone[order][:-1]) + 1)
    if len(rigs) < 2:
        return None
    found = np.empty(alone.size)
    for rig in rigs:
        found[rig] = np.median(alone[rig])
    return found


def _sensor_deviation(run: Recording, quantity: str, timed: bool) -> float:
    """Of one recording's sensor; 0 where it shows nothing."""
    values = run[quantity][np.isfinite(run[quantity])]
    if not values.size:
        return 0.0
    sensor = estimate_sensors(Recording({quantity: values}, run.origin)).get(quantity)
    if sensor is None:
        return 0.0
    return sensor.deviation if timed else float(sensor.resolution / np.sqrt(12.0))
