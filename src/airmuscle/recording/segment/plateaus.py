"""Plateaus: stretches in which pressure, length and force rest, each good for one static point."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .quasi_static import MAX_CHANGE, quasi_static_rows
from .sampling import count_rows
from .sensor import Sensor, estimate_sensors
from .interval import Interval, level_intervals, true_intervals

MIN_DURATION = 0.2
"""The shortest plateau [s] (chosen)."""
MIN_ROWS = 3
"""The fewest rows of one (chosen)."""


@dataclasses.dataclass(frozen=True)
class Plateau:
    """Where a plateau is, and for each column its median and the standard deviation of that mean [SI]."""

    interval: Interval
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]


def find_plateaus(
    recording: Recording, sensed: Mapping[str, Sensor] | None = None, *, least: float = MIN_DURATION
) -> tuple[Plateau, ...]:
    """The plateaus of the pressure among the quasi-static rows; none without time, and none on a slow ramp.

    A plateau stays within twice the change that is quasi-static, and does not run through it from end to end.
    """
    if "time" not in recording or "pressure" not in recording or len(recording) < MIN_ROWS:
        return ()
    pressure, sensed = recording["pressure"], sensed or estimate_sensors(recording)
    band = max(2.0 * MAX_CHANGE * float(np.ptp(pressure)), 8.0 * sensed["pressure"].std)
    fewest = max(MIN_ROWS, count_rows(least, recording["time"], MIN_ROWS))
    return tuple(
        _make_plateau(recording, stretch)
        for calm in true_intervals(quasi_static_rows(recording, sensed))
        for stretch in level_intervals(pressure, band, within=calm)
        if len(stretch) >= fewest and not _drifts(pressure[stretch.rows], band)
    )


def _drifts(pressure: Array, band: float) -> bool:
    third = max(len(pressure) // 3, 1)
    return bool(abs(np.median(pressure[-third:]) - np.median(pressure[:third])) > 0.4 * band)


def _make_plateau(recording: Recording, stretch: Interval) -> Plateau:
    rows = {name: recording[name][stretch.rows] for name in recording}
    values = {name: float(np.median(values)) for name, values in rows.items()}
    count = np.sqrt(len(stretch))
    return Plateau(stretch, values, {name: float(np.std(values) / count) for name, values in rows.items()})


def plateau_points(recording: Recording, found: tuple[Plateau, ...]) -> Recording:
    """A recording with one row for each plateau: what a static fit of a stepped test should see."""
    columns = {name: np.array([p.values[name] for p in found]) for name in recording}
    note = f"{len(found)} plateaus stand for {sum(len(p.interval) for p in found)} of {len(recording)} rows."
    return dataclasses.replace(recording, columns=columns, notes=(*recording.notes, note))
