"""Sensor standard deviations by recording, for inverse-variance weights across test rigs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError
from ..recording import Recording
from ..recording.segment import estimate_sensors

MIN_SENSOR_RATIO = 2.0
"""Minimum ratio of neighbouring standard deviations of two different sensors (chosen: estimates of the standard
deviation of one sensor differ less)."""


def sensor_deviations(runs: Sequence[Recording], quantity: str) -> Array | None:
    """The standard deviation of one observation in each recording [SI], shape (recordings,).

    It includes noise and quantisation where every recording has a time column, otherwise quantisation alone, because
    the rows are then in no known order. Recordings with similar standard deviations are attributed to one test rig and
    share their median. None where all recordings are of one rig, or a sensor shows neither noise nor resolution.
    """
    timed = all("time" in run.columns for run in runs)
    estimates = []
    for run in runs:
        try:
            estimates.append(_sensor_deviation(run, quantity, timed))
        except ColumnError:
            return None
        if not estimates[-1] > 0:
            return None
    single = np.array(estimates)
    order = np.argsort(single)
    if not single.size:
        return None
    rigs = np.split(order, np.flatnonzero(single[order][1:] > MIN_SENSOR_RATIO * single[order][:-1]) + 1)
    if len(rigs) < 2:
        return None
    deviations = np.empty(single.size)
    for rig in rigs:
        deviations[rig] = np.median(single[rig])
    return deviations


def _sensor_deviation(run: Recording, quantity: str, timed: bool) -> float:
    """The standard deviation of the sensor of one recording; 0 where it cannot be estimated."""
    values = run[quantity][np.isfinite(run[quantity])]
    if not values.size:
        return 0.0
    sensor = estimate_sensors(Recording({quantity: values}, run.origin)).get(quantity)
    if sensor is None:
        return 0.0
    return sensor.std if timed else float(sensor.resolution / np.sqrt(12.0))
