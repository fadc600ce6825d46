"""Sensor standard deviations by recording, for inverse-variance weights across test rigs."""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np

from ...core.arrays import Array
from ...core.errors import ColumnError
from ...recording import Recording
from ..segment import estimate_sensors

MIN_SENSOR_RATIO = 2.0
"""Minimum ratio of neighbouring standard deviations of two different sensors (chosen: estimates of the standard
deviation of one sensor differ less)."""
_known: weakref.WeakKeyDictionary[Recording, dict[str, tuple[float, float]]] = weakref.WeakKeyDictionary()
"""Noise and quantisation by recording and column: cross-validation asks for the same recordings in every fold."""


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
    if not single.size:
        return None
    coarse = np.array([_coarse_deviation(run, quantity, timed) for run in runs])
    order = np.argsort(coarse)
    rigs = np.split(order, np.flatnonzero(coarse[order][1:] > MIN_SENSOR_RATIO * coarse[order][:-1]) + 1)
    if len(rigs) < 2:
        return None
    deviations = np.empty(single.size)
    for rig in rigs:
        deviations[rig] = np.median(single[rig])
    return deviations


def _coarse_deviation(run: Recording, quantity: str, timed: bool) -> float:
    """The standard deviation with the whole resolution, by which rigs are told apart: the noise of readings that change
    by few steps of the resolution is estimated as none or as a whole step."""
    deviation, quantisation = _known[run][quantity]
    return float(np.hypot(deviation, quantisation * np.sqrt(12.0))) if timed else quantisation


def _sensor_deviation(run: Recording, quantity: str, timed: bool) -> float:
    """The standard deviation of the sensor of one recording; 0 where it cannot be estimated."""
    stored = _known.setdefault(run, {})
    if quantity not in stored:
        values = run[quantity][np.isfinite(run[quantity])]
        sensors = estimate_sensors(Recording({quantity: values}, run.origin)) if values.size else {}
        sensor = sensors.get(quantity)
        stored[quantity] = (0.0, 0.0) if sensor is None else (sensor.std, float(sensor.resolution / np.sqrt(12.0)))
    return stored[quantity][0 if timed else 1]
