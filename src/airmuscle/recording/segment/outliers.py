"""Readings that their neighbours contradict: found robustly, listed, never removed.

A glitch is one or two rows that stand away from the rows before and behind by more than eight deviations of the
sensor, while those agree with each other. The overshoot of a step is none: there the rows behind stand elsewhere.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .sensor import Sensor, estimate_sensors

MIN_DEVIATIONS = 8.0
"""How many deviations make a glitch (chosen: noise with long tails reaches five or six)."""
MAX_NEIGHBOUR_DIFFERENCE = 0.25
"""The neighbours agree where they differ by less than this part of the glitch (chosen)."""
WINDOW = 3
"""Rows before and behind that are compared."""


@dataclasses.dataclass(frozen=True)
class Outlier:
    """A suspected glitch: its column and row (from 0), the reading, and what the rows around it say [SI]."""

    column: str
    row: int
    value: float
    expected: float
    deviations: float


def find_outliers(recording: Recording, sensed: Mapping[str, Sensor] | None = None) -> tuple[Outlier, ...]:
    """The suspected glitches of a recording in time; without time, neighbours say nothing and none is listed."""
    if "time" not in recording or len(recording) < 2 * WINDOW + 2:
        return ()
    return tuple(
        found
        for name, sensor in (sensed or estimate_sensors(recording)).items()
        if name in recording.columns
        for found in _column_outliers(name, recording[name], sensor)
    )


def _column_outliers(name: str, values: Array, sensor: Sensor) -> Iterator[Outlier]:
    scale = sensor.std or 1e-9 * float(np.max(np.abs(values)))
    if scale == 0.0:
        return
    before, behind = _medians_around(values)
    off = values - 0.5 * (before + behind)
    away = np.abs(off) > MIN_DEVIATIONS * scale
    agree = np.abs(before - behind) < MAX_NEIGHBOUR_DIFFERENCE * np.abs(off)
    for row in np.flatnonzero(away & agree):
        expected = float(values[row] - off[row])
        yield Outlier(name, int(row), float(values[row]), expected, float(abs(off[row]) / scale))


def _medians_around(values: Array) -> tuple[Array, Array]:
    """The medians of the rows before and behind each; at the ends, where there are too few, the row itself."""
    medians = np.median(np.lib.stride_tricks.sliding_window_view(values, WINDOW), axis=1)
    before, behind = values.copy(), values.copy()
    before[WINDOW:] = medians[:-1]
    behind[:-WINDOW] = medians[1:]
    before[-WINDOW:] = values[-WINDOW:]
    behind[:WINDOW] = values[:WINDOW]
    return before, behind
