"""Plateaus, intervals of constant pressure, length and force, and quasi-static rows with their
rates of change.

A row is quasi-static if the pressure, and the length if measured, change within SETTLING_TIME by at
most the fraction `max_change` of their range, or by no more than the noise explains. Both numbers
are chosen: 0.1 s is the time in which a muscle of usual size follows its pressure, and a change of
1 % is negligible for a static fit.
"""

import dataclasses
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from ...core import Array
from ...recording.columns import MOVED
from ...recording.recording import Recording
from .interval import Interval, Mask, level_intervals, running_median, true_intervals
from .resolution import rounding
from .sensor import Sensor, count_rows, estimate_sensors

SETTLING_TIME = 0.1
MAX_CHANGE = 0.01
NOISE_FACTOR = 5.7
"""Difference of two readings that is noise, in standard deviations of one: four of the difference
(chosen).
"""
_MONITORED = ("pressure", *MOVED)


def quasi_static_rows(
    recording: Recording,
    sensors: Mapping[str, Sensor] | None = None,
    *,
    max_change: float = MAX_CHANGE,
) -> Mask:
    """Whether each row is quasi-static (N,). Without time, every row is taken as a steady state."""
    quasi_static = np.ones(len(recording), dtype=bool)
    if "time" not in recording or len(recording) < 3:
        return quasi_static
    width = count_rows(SETTLING_TIME, recording["time"], 1)
    sensors = sensors or estimate_sensors(recording)
    for name in recording:
        if name.rpartition(".")[2] in _MONITORED and name in sensors and width < len(recording):
            values = recording[name]
            change = max_change * float(np.ptp(values))
            allowed = max(change, NOISE_FACTOR * sensors[name].std, rounding(name, values))
            changes = np.abs(values[width:] - values[:-width]) > allowed
            quasi_static[:-width] &= ~changes
            quasi_static[width:] &= ~changes
    return quasi_static


RATE_LEVEL = 0.95
"""Share of the rows that change at most at the stated rate (chosen)."""
MIN_CHANGE = 30.0
"""Minimum change over an interval of which a rate is computed, in standard deviations of the sensor
(chosen).
"""


def rate_of_change(recording: Recording, name: str) -> float:
    """The rate that 95 % of the rows do not exceed [SI per s]; 0 without time or where the quantity
    is constant. The interval is doubled from one row until the change within it exceeds the
    noise."""
    if "time" not in recording or name not in recording:
        return 0.0
    time = recording["time"]
    values = recording[name]
    sensor = estimate_sensors(recording).get(name)
    least = max(MIN_CHANGE * (sensor.std if sensor else 0.0), rounding(name, values))
    width = 1
    while width < len(recording):
        change = np.abs(values[width:] - values[:-width])
        span = time[width:] - time[:-width]
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


CONSTANT_COLUMNS = ("pressure", *MOVED, "force")
"""Columns that are constant in a plateau, where they were measured."""
MIN_DURATION = 0.2
MIN_ROWS = 3
"""Minimum duration [s] and number of rows of a plateau (chosen)."""
MEDIAN_ROWS = 3
"""Width of the moving median before the search for levels, in rows."""
MAX_DRIFT = 0.25
DRIFT_PARTS = 5
"""Maximum drift of a plateau, as a fraction of its band, and number of parts that show it; three if
it is short.
"""


@dataclasses.dataclass(frozen=True)
class Plateau:
    """The interval of a plateau, and for each column the median and the standard error of the mean
    [SI].
    """

    interval: Interval
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]


def find_plateaus(
    recording: Recording,
    sensors: Mapping[str, Sensor] | None = None,
    *,
    columns: Collection[str] = CONSTANT_COLUMNS,
) -> tuple[Plateau, ...]:
    """The plateaus among the quasi-static rows; empty without time or pressure, and for a slow
    ramp.

    In a plateau each of the `columns` that were measured stays within twice the maximum
    quasi-static change of its range, or within its noise, and does not drift through this band.
    """
    if "time" not in recording or "pressure" not in recording or len(recording) < MIN_ROWS:
        return ()
    sensors = sensors or estimate_sensors(recording)
    bands = {}
    for name in columns:
        if (
            name in recording and name in sensors
        ):  # of its quasi-static change, its noise, or rounding
            change = 2.0 * MAX_CHANGE * float(np.ptp(recording[name]))
            least = rounding(name, recording[name])
            bands[name] = max(change, 8.0 * sensors[name].std, least)
    min_rows = max(MIN_ROWS, count_rows(MIN_DURATION, recording["time"], MIN_ROWS))
    intervals = true_intervals(quasi_static_rows(recording, sensors))
    for name, band in bands.items():
        values = running_median(
            recording[name], MEDIAN_ROWS
        )  # so that an outlier does not end a plateau
        intervals = [
            part
            for candidate in intervals
            for part in _steady_parts(values, band, sensors[name].jitter, candidate, min_rows)
        ]
    plateaus = []
    for interval in intervals:
        rows = {name: recording[name][interval.rows] for name in recording}
        medians = {name: float(np.median(values)) for name, values in rows.items()}
        errors = {
            name: float(np.std(values, ddof=1) / np.sqrt(len(interval)))
            for name, values in rows.items()
        }
        plateaus.append(Plateau(interval, medians, errors))
    return tuple(plateaus)


def _steady_parts(
    values: Array, band: float, jitter: float, within: Interval, min_rows: int
) -> Iterator[Interval]:
    """The parts of an interval in which a quantity stays within its band without drift; a change by
    the jitter of a reading is none.
    """
    for level in level_intervals(values, band, within=within):
        inside = values[level.rows]  # without the start and the end of a ramp from or to the level
        near = np.flatnonzero(np.abs(inside - np.median(inside)) <= 0.25 * band)
        part = (
            Interval(level.start + int(near[0]), level.start + int(near[-1]) + 1)
            if near.size
            else Interval(0, 0)
        )
        count = DRIFT_PARTS if len(part) >= 5 * DRIFT_PARTS else 3
        medians = [
            float(np.median(section))
            for section in np.array_split(values[part.rows], count)
            if section.size
        ]
        drift = max(medians, default=0.0) - min(medians, default=0.0)
        if len(part) >= min_rows and not drift > max(MAX_DRIFT * band, jitter):
            yield part


def plateau_points(recording: Recording, plateaus: tuple[Plateau, ...]) -> Recording:
    """A recording with one row for each plateau, as input for a static fit of a stepped test."""
    columns = {name: np.array([p.values[name] for p in plateaus]) for name in recording}
    note = (
        f"{len(plateaus)} plateaus replace {sum(len(p.interval) for p in plateaus)} of"
        f" {len(recording)} rows."
    )
    return dataclasses.replace(recording, columns=columns, notes=(*recording.notes, note))
