"""Plateaus: intervals in which pressure, length and force are constant; each gives one static point."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .interval import Interval, level_intervals, true_intervals
from .quasi_static import MAX_CHANGE, quasi_static_rows
from .sampling import count_rows
from .sensor import Sensor, estimate_sensors

MIN_DURATION = 0.2
"""Minimum duration of a plateau [s] (chosen)."""
MIN_ROWS = 3
"""Minimum number of rows of a plateau (chosen)."""


@dataclasses.dataclass(frozen=True)
class Plateau:
    """The interval of a plateau, and for each column the median and the standard error of the mean [SI]."""

    interval: Interval
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]


def find_plateaus(
    recording: Recording, sensors: Mapping[str, Sensor] | None = None, *, min_duration: float = MIN_DURATION
) -> tuple[Plateau, ...]:
    """The pressure plateaus among the quasi-static rows; empty without time, and for a slow ramp.

    A plateau stays within twice the maximum quasi-static change, and does not drift through this band.
    """
    if "time" not in recording or "pressure" not in recording or len(recording) < MIN_ROWS:
        return ()
    pressure, sensors = recording["pressure"], sensors or estimate_sensors(recording)
    band = max(2.0 * MAX_CHANGE * float(np.ptp(pressure)), 8.0 * sensors["pressure"].std)
    min_rows = max(MIN_ROWS, count_rows(min_duration, recording["time"], MIN_ROWS))
    return tuple(
        _make_plateau(recording, interval)
        for quasi_static in true_intervals(quasi_static_rows(recording, sensors))
        for interval in level_intervals(pressure, band, within=quasi_static)
        if len(interval) >= min_rows and not _drifts(pressure[interval.rows], band)
    )


def _drifts(pressure: Array, band: float) -> bool:
    third = max(len(pressure) // 3, 1)
    return bool(abs(np.median(pressure[-third:]) - np.median(pressure[:third])) > 0.4 * band)


def _make_plateau(recording: Recording, interval: Interval) -> Plateau:
    rows = {name: recording[name][interval.rows] for name in recording}
    medians = {name: float(np.median(values)) for name, values in rows.items()}
    root_count = np.sqrt(len(interval))
    return Plateau(interval, medians, {name: float(np.std(values) / root_count) for name, values in rows.items()})


def plateau_points(recording: Recording, plateaus: tuple[Plateau, ...]) -> Recording:
    """A recording with one row for each plateau, as input for a static fit of a stepped test."""
    columns = {name: np.array([p.values[name] for p in plateaus]) for name in recording}
    rows = sum(len(p.interval) for p in plateaus)
    note = f"{len(plateaus)} plateaus replace {rows} of {len(recording)} rows."
    return dataclasses.replace(recording, columns=columns, notes=(*recording.notes, note))
