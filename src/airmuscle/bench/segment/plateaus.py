"""Plateaus: intervals in which pressure, length and force are constant; each gives one static point."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Mapping

import numpy as np

from ...core.arrays import Array
from ...recording.displacement import MOVED
from ...recording.recording import Recording
from .interval import Interval, level_intervals, running_median, true_intervals
from .quasi_static import MAX_CHANGE, quasi_static_rows
from .sampling import count_rows
from .sensor import Sensor, estimate_sensors

CONSTANT_COLUMNS = ("pressure", *MOVED, "force")
"""Columns that are constant in a plateau, where they were measured."""
MIN_DURATION = 0.2
"""Minimum duration of a plateau [s] (chosen)."""
MEDIAN_ROWS = 3
"""Width of the moving median before the search for levels, in rows."""
MAX_DRIFT = 0.25
"""Maximum drift of a plateau, as a fraction of its band (chosen)."""
DRIFT_PARTS = 5
"""Number of parts of a plateau whose medians show a drift; three if it is short."""
MIN_ROWS = 3
"""Minimum number of rows of a plateau (chosen)."""


@dataclasses.dataclass(frozen=True)
class Plateau:
    """The interval of a plateau, and for each column the median and the standard error of the mean [SI]."""

    interval: Interval
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]


def find_plateaus(
    recording: Recording,
    sensors: Mapping[str, Sensor] | None = None,
    *,
    min_duration: float = MIN_DURATION,
    columns: Collection[str] = CONSTANT_COLUMNS,
) -> tuple[Plateau, ...]:
    """The plateaus among the quasi-static rows; empty without time or pressure, and for a slow ramp.

    In a plateau each of the `columns` that were measured stays within twice the maximum quasi-static change of its
    range, or within its noise, and does not drift through this band.
    """
    if "time" not in recording or "pressure" not in recording or len(recording) < MIN_ROWS:
        return ()
    sensors = sensors or estimate_sensors(recording)
    bands = {name: _band(recording[name], sensors[name]) for name in columns if name in recording and name in sensors}
    min_rows = max(MIN_ROWS, count_rows(min_duration, recording["time"], MIN_ROWS))
    intervals = true_intervals(quasi_static_rows(recording, sensors))
    for name, band in bands.items():
        values = running_median(recording[name], MEDIAN_ROWS)  # so that an outlier does not end a plateau
        intervals = [part for each in intervals for part in _steady_parts(values, band, each, min_rows)]
    return tuple(_make_plateau(recording, interval) for interval in intervals)


def _steady_parts(values: Array, band: float, within: Interval, min_rows: int) -> Iterator[Interval]:
    """The parts of an interval in which a quantity stays within its band without drift."""
    for level in level_intervals(values, band, within=within):
        part = _trim_to_level(values, level, band)
        if len(part) >= min_rows and not _drifts(values[part.rows], band):
            yield part


def _trim_to_level(values: Array, level: Interval, band: float) -> Interval:
    """The interval without the start and the end of a ramp from or to its level."""
    inside = values[level.rows]
    near = np.flatnonzero(np.abs(inside - np.median(inside)) <= 0.25 * band)
    return Interval(level.start + int(near[0]), level.start + int(near[-1]) + 1) if near.size else Interval(0, 0)


def _band(values: Array, sensor: Sensor) -> float:
    """The band of a constant quantity [SI]: of its quasi-static change, its noise, or rounding."""
    rounding = 1e-9 * float(np.max(np.abs(values)))
    return max(2.0 * MAX_CHANGE * float(np.ptp(values)), 8.0 * sensor.std, rounding)


def _drifts(values: Array, band: float) -> bool:
    count = DRIFT_PARTS if len(values) >= 5 * DRIFT_PARTS else 3
    parts = [float(np.median(part)) for part in np.array_split(values, count) if part.size]
    return max(parts) - min(parts) > MAX_DRIFT * band


def _make_plateau(recording: Recording, interval: Interval) -> Plateau:
    rows = {name: recording[name][interval.rows] for name in recording}
    medians = {name: float(np.median(values)) for name, values in rows.items()}
    root_count = np.sqrt(len(interval))
    errors = {name: float(np.std(values, ddof=1) / root_count) for name, values in rows.items()}
    return Plateau(interval, medians, errors)


def plateau_points(recording: Recording, plateaus: tuple[Plateau, ...]) -> Recording:
    """A recording with one row for each plateau, as input for a static fit of a stepped test."""
    columns = {name: np.array([p.values[name] for p in plateaus]) for name in recording}
    rows = sum(len(p.interval) for p in plateaus)
    note = f"{len(plateaus)} plateaus replace {rows} of {len(recording)} rows."
    return dataclasses.replace(recording, columns=columns, notes=(*recording.notes, note))
