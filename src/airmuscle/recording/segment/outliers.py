"""Outliers: readings that contradict their neighbours, detected robustly, listed and never removed.

An outlier consists of one or two rows that differ from the rows before and after by more than eight standard deviations
of the sensor, while those rows agree with each other. The overshoot of a step is not an outlier, because the rows after
it are at another level. Nor is the turning point of a ramp, because it lies on a line through the rows before or after.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .sensor import Sensor, estimate_sensors

MIN_DEVIATIONS = 8.0
"""Minimum distance of an outlier in standard deviations (chosen: noise with heavy tails reaches five or six)."""
MAX_NEIGHBOUR_DIFFERENCE = 0.25
"""Maximum difference between the rows before and after, as a fraction of the outlier's distance (chosen)."""
MIN_EXTRAPOLATION_ERROR = 0.5
"""Minimum distance of an outlier from the extrapolated neighbours, as a fraction of its distance (chosen)."""
SLOPE_STEPS = 5
"""Number of steps between rows whose median is the slope before and after a row."""
WINDOW = 3
"""Number of rows before and after that are compared."""


@dataclasses.dataclass(frozen=True)
class Outlier:
    """A suspected outlier: column, row (from 0), reading, value expected from its neighbours [SI], and distance.

    `deviations` is the distance from the expected value in standard deviations of the sensor.
    """

    column: str
    row: int
    value: float
    expected: float
    deviations: float


def find_outliers(recording: Recording, sensors: Mapping[str, Sensor] | None = None) -> tuple[Outlier, ...]:
    """The suspected outliers of a recording; empty without time, because rows are then not neighbours in time."""
    if "time" not in recording or len(recording) < 2 * WINDOW + 2:
        return ()
    return tuple(
        outlier
        for name, sensor in (sensors or estimate_sensors(recording)).items()
        if name in recording.columns
        for outlier in _column_outliers(name, recording[name], sensor)
    )


def _column_outliers(name: str, values: Array, sensor: Sensor) -> Iterator[Outlier]:
    scale = sensor.std or 1e-9 * float(np.max(np.abs(values)))
    if scale == 0.0:
        return
    before, after = _neighbour_medians(values)
    distance = values - 0.5 * (before + after)
    is_far = np.abs(distance) > MIN_DEVIATIONS * scale
    agree = np.abs(before - after) < MAX_NEIGHBOUR_DIFFERENCE * np.abs(distance)
    is_far &= _distance_from_lines(values, before, after) > MIN_EXTRAPOLATION_ERROR * np.abs(distance)
    for row in np.flatnonzero(is_far & agree):
        expected = float(values[row] - distance[row])
        yield Outlier(name, int(row), float(values[row]), expected, float(abs(distance[row]) / scale))


def _neighbour_medians(values: Array) -> tuple[Array, Array]:
    """The medians of the rows before and after each row; the row itself near the ends, where there are too few rows."""
    medians = np.median(np.lib.stride_tricks.sliding_window_view(values, WINDOW), axis=1)
    before, after = values.copy(), values.copy()
    before[WINDOW:] = medians[:-1]
    after[:-WINDOW] = medians[1:]
    before[-WINDOW:] = values[-WINDOW:]
    after[:WINDOW] = values[:WINDOW]
    return before, after


def _distance_from_lines(values: Array, before: Array, after: Array) -> Array:
    """The smaller distance of each row from the lines through the rows before and after it."""
    back, ahead = np.zeros(len(values)), np.zeros(len(values))
    if len(values) > SLOPE_STEPS + 1:
        slopes = np.median(np.lib.stride_tricks.sliding_window_view(np.diff(values), SLOPE_STEPS), axis=1)
        back[SLOPE_STEPS + 1 :] = slopes[:-1]
        ahead[: -(SLOPE_STEPS + 1)] = slopes[1:]
    reach = 0.5 * (WINDOW + 1)
    return np.asarray(np.minimum(np.abs(values - before - reach * back), np.abs(values - after + reach * ahead)))
