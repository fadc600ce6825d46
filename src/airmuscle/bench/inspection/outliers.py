"""Outliers: readings that contradict their neighbours, detected robustly, listed, and left out on
request.

An outlier consists of one or two rows that differ from the rows before and after by more than eight
standard deviations of the sensor, while those rows agree with each other. The overshoot of a step
is not an outlier, because the rows after it are at another level. Nor is the turning point of a
ramp, because it lies on a line through the rows before or after.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording.columns import display_scale
from ...recording.recording import Recording, RowNote
from .sensor import Sensor, estimate_sensors

MIN_DEVIATIONS = 8.0
"""Minimum distance of an outlier in standard deviations (chosen: noise with heavy tails reaches
five or six).
"""
MAX_NEIGHBOUR_DIFFERENCE = 0.25
"""Maximum difference between the rows before and after, as a fraction of the outlier's distance
(chosen).
"""
MIN_EXTRAPOLATION_ERROR = 0.5
"""Minimum distance of an outlier from the extrapolated neighbours, as a fraction of its distance
(chosen).
"""
SLOPE_STEPS = 5
WINDOW = 3
"""Number of steps whose median is the slope, and of rows that are compared, before and after a
row.
"""
MAX_LISTED = 8
"""Maximum number of outliers that a note lists (chosen)."""


@dataclasses.dataclass(frozen=True)
class Outlier:
    """A suspected outlier: column, row (from 0), reading, value expected from its neighbours [SI],
    and distance.

    `deviations` is the distance from the expected value in standard deviations of the sensor.
    """

    column: str
    row: int
    value: float
    expected: float
    deviations: float

    def __str__(self) -> str:
        factor, unit = display_scale(self.column)
        reading, expected = (
            f"{value * factor:.4g} {unit}" for value in (self.value, self.expected)
        )
        return f"{self.column} in row {self.row + 1} ({reading}, neighbours {expected})"


def find_outliers(
    recording: Recording, sensors: Mapping[str, Sensor] | None = None
) -> tuple[Outlier, ...]:
    """The suspected outliers of a recording; empty without time, because rows are then not
    neighbours in time.
    """
    if "time" not in recording or len(recording) < 2 * WINDOW + 2:
        return ()
    known = {
        n: sensor
        for n, sensor in (sensors or estimate_sensors(recording)).items()
        if n in recording.columns
    }
    return tuple(
        outlier
        for n, sensor in known.items()
        for outlier in _column_outliers(n, recording[n], sensor)
    )


def without_outliers(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings of one test rig without the rows of suspected outliers; a note on each
    recording lists them.
    """
    bench_outliers = find_bench_outliers(recordings)
    return tuple(
        leave_out(recording, outliers)
        for recording, outliers in zip(recordings, bench_outliers, strict=True)
    )


def find_bench_outliers(recordings: Sequence[Recording]) -> tuple[tuple[Outlier, ...], ...]:
    """The suspected outliers of each recording of one test rig, whose files share the noise of the
    sensors.
    """
    sensors = estimate_sensors(recordings) if recordings else {}
    return tuple(find_outliers(recording, sensors) for recording in recordings)


def kept_rows(recording: Recording, outliers: Sequence[Outlier]) -> npt.NDArray[np.bool_]:
    """The rows that contain none of the outliers, shape (N,)."""
    is_regular = np.ones(len(recording), dtype=bool)
    is_regular[[outlier.row for outlier in outliers]] = False
    return is_regular


def leave_out(recording: Recording, outliers: Sequence[Outlier]) -> Recording:
    """The recording without the rows of these outliers, which a note lists."""
    if "time" not in recording:
        note = (
            f"{recording.origin}: without time, rows are no neighbours, and no outlier is left out."
        )
        return dataclasses.replace(recording, notes=(*recording.notes, RowNote(note)))
    if not outliers:
        return recording
    is_regular = kept_rows(recording, outliers)
    count = int(np.count_nonzero(~is_regular))
    more = f"; and {len(outliers) - MAX_LISTED} more" if len(outliers) > MAX_LISTED else ""
    note = (
        f"{recording.origin}: rows left out as suspected outliers: {count} of {len(is_regular)}: "
        f"{'; '.join(map(str, outliers[:MAX_LISTED]))}{more}."
    )
    return dataclasses.replace(recording.rows(is_regular), notes=(*recording.notes, RowNote(note)))


def _column_outliers(name: str, values: Array, sensor: Sensor) -> Iterator[Outlier]:
    """Rows far from the medians of those before and after, which agree, and from the lines through
    either of them.
    """
    scale = sensor.std or 1e-9 * float(np.max(np.abs(values)))
    if scale == 0.0:
        return
    medians = np.median(np.lib.stride_tricks.sliding_window_view(values, WINDOW), axis=1)
    # near the ends, where there are too few rows
    before = values.copy()
    after = values.copy()
    before[WINDOW:-WINDOW] = medians[: -WINDOW - 1]
    after[WINDOW:-WINDOW] = medians[WINDOW + 1 :]
    distance = values - 0.5 * (before + after)
    back = np.zeros(len(values))
    ahead = np.zeros(len(values))
    if len(values) > SLOPE_STEPS + 1:
        slopes = np.median(
            np.lib.stride_tricks.sliding_window_view(np.diff(values), SLOPE_STEPS), axis=1
        )
        back[SLOPE_STEPS + 1 :] = slopes[:-1]
        ahead[: -(SLOPE_STEPS + 1)] = slopes[1:]
    reach = 0.5 * (WINDOW + 1)
    from_lines = np.minimum(
        np.abs(values - before - reach * back), np.abs(values - after + reach * ahead)
    )
    is_outlier = np.abs(distance) > MIN_DEVIATIONS * scale
    is_outlier &= np.abs(before - after) < MAX_NEIGHBOUR_DIFFERENCE * np.abs(distance)
    is_outlier &= from_lines > MIN_EXTRAPOLATION_ERROR * np.abs(distance)
    for row in np.flatnonzero(is_outlier):
        expected = float(values[row] - distance[row])
        yield Outlier(
            name, int(row), float(values[row]), expected, float(abs(distance[row]) / scale)
        )
