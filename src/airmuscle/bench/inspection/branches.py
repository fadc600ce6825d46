"""Branches: motion of the driven quantity in one direction, such as inflation and deflation.

The driven quantity of an isobaric run is the contraction, length or position; that of all other
runs is the pressure. A branch ends where this quantity has moved back from an extreme by more than
a fraction `reversal` of its range; smaller ripples do not end it. A branch ends with its run, too,
because the muscle was moved or loaded anew before the next run. A dwell at an extreme belongs to
the branch before it, because friction depends on the previous motion: the reversal is placed at the
last row before the quantity leaves the level of the dwell. A branch column in the file is not used;
`branch_column_agreement` compares it with the result.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from ...core import Array
from ...recording.recording import Recording
from .interval import Interval, remembered, running_median
from .resolution import rounding
from .runs import AT_REST, ISOBARIC, ISOMETRIC, ISOTONIC, Run, find_runs, moved_column
from .sensor import Sensor, count_rows, estimate_noise

REVERSAL_FRACTION = 0.05
EXIT_FRACTION = 0.25
"""Fraction of the range that the pressure moves back in a reversal, and fraction of that by which
it leaves a dwell.
"""
SPIKE_DURATION = 0.15
"""Overshoots of a valve pulse shorter than this [s] are not reversals (chosen)."""


@dataclasses.dataclass(frozen=True)
class Branch:
    """Rows of one direction of the driven quantity `column`, and the pressures at both ends [Pa].

    `direction` is 1 where the muscle inflates or contracts, -1 where it deflates or extends.
    """

    interval: Interval
    direction: int
    start_pressure: float
    end_pressure: float
    column: str = "pressure"

    @property
    def name(self) -> str:
        """`inflating` or `deflating` where the pressure is driven, otherwise `contracting` or
        `extending`.
        """
        return branch_name(self.column, self.direction)


def branch_name(column: str, direction: int) -> str:
    """The name of a branch of a driven column: inflating, deflating, contracting or extending."""
    names = ("inflating", "deflating") if column == "pressure" else ("contracting", "extending")
    return names[0] if direction > 0 else names[1]


@remembered
def find_branches(
    recording: Recording,
    sensor: Sensor | None = None,
    *,
    reversal: float = REVERSAL_FRACTION,
    runs: tuple[Run, ...] | None = None,
) -> tuple[Branch, ...]:
    """The branches of a recording in order; empty if there is no pressure or if the driven quantity
    is constant.

    A reversal exceeds the fraction `reversal` of the range of the driven quantity and ten standard
    deviations of its sensor; `sensor` is that of the pressure, `runs` are those of `find_runs`.
    Without time, rows are taken in order.
    """
    if "pressure" not in recording or len(recording) < 3:
        return ()
    runs = find_runs(recording) if runs is None else runs
    time = recording.columns.get("time")
    column, parts = _driven_quantity(recording, runs)
    smooth = []
    for part in parts:
        time_of_part = None if time is None else time[part.rows]
        smooth.append(_remove_spikes(recording[column][part.rows], time_of_part))
    if column == "pressure":  # of all parts, which are one sweep of one sensor
        std = sensor.std if sensor else 0.0
        if sensor is None and any(run.kind == AT_REST for run in runs):
            std = estimate_noise(recording["pressure"])
        threshold = _reversal_threshold(column, np.concatenate(smooth), std, reversal)
        thresholds = [threshold] * len(parts)
    else:
        thresholds = []
        for values in smooth:
            std = 0.0 if time is None else estimate_noise(values)
            thresholds.append(_reversal_threshold(column, values, std, reversal))
    branches = []
    for part, values, threshold in zip(parts, smooth, thresholds, strict=True):
        pressure = values if column == "pressure" else recording["pressure"][part.rows]
        for stretch, sign in _monotonic_intervals(values, threshold):
            first = float(pressure[stretch.start])
            last = float(pressure[stretch.stop - 1])
            interval = Interval(part.start + stretch.start, part.start + stretch.stop)
            direction = -sign if column == "length" else sign
            branches.append(Branch(interval, direction, first, last, column))
    return tuple(branches)


def _driven_quantity(recording: Recording, runs: tuple[Run, ...]) -> tuple[str, Sequence[Interval]]:
    """The driven quantity and the intervals in which it is: the motion if most rows are of isobaric
    runs, otherwise the pressure.
    """
    moved = moved_column(recording)
    isobaric = [run.interval for run in runs if run.kind == ISOBARIC and moved in run.swept_columns]
    if moved and 2 * sum(map(len, isobaric)) > len(recording):
        return moved, isobaric
    return "pressure", _split_at_runs(recording, runs)


def _reversal_threshold(column: str, values: Array, std: float, reversal: float) -> float:
    """The change that a reversal exceeds: of the range, of the noise, and of the rounding."""
    return max(reversal * float(np.ptp(values)), 10.0 * std, rounding(column, values))


def _split_at_runs(recording: Recording, runs: tuple[Run, ...]) -> list[Interval]:
    """Runs at other lengths or loads and the rows between them; the whole recording if most rows
    are in no such run.
    """
    separate = [run.interval for run in runs if run.kind in (ISOMETRIC, ISOTONIC)]
    if 2 * sum(len(interval) for interval in separate) <= len(recording):
        separate = []
    edges = {0, len(recording)}
    for earlier, later in itertools.pairwise(separate):
        edges |= {earlier.stop, later.start}
    return [Interval(start, stop) for start, stop in itertools.pairwise(sorted(edges))]


def motion_direction(
    values: Array, time: Array | None = None, *, reversal: float = REVERSAL_FRACTION
) -> Array:
    """The direction of motion (N,) of any signal (N,): 1 rising, -1 falling, 0 everywhere if the
    signal is constant. Reversals are detected as for the branches of the pressure."""
    smooth = _remove_spikes(values, time)
    signs = np.zeros(len(values))
    threshold = max(reversal * float(np.ptp(smooth)), rounding("", smooth)) if len(smooth) else 0.0
    for interval, direction in _monotonic_intervals(smooth, threshold):
        signs[interval.rows] = direction
    return signs


def _remove_spikes(values: Array, time: Array | None) -> Array:
    return (
        values
        if time is None
        else running_median(values, 2 * count_rows(SPIKE_DURATION / 2.0, time, 1) + 1)
    )


def _monotonic_intervals(smooth: Array, threshold: float) -> list[tuple[Interval, int]]:
    """The intervals between reversals, each with its direction; empty if the range does not exceed
    `threshold`.
    """
    if not len(smooth) or not float(np.ptp(smooth)) > threshold:
        return []
    reversals = list(_find_reversals(smooth, threshold))
    directions = [direction for _, direction in reversals]
    edges = [0, *(row for row, _ in reversals[1:]), len(smooth)]
    intervals = [Interval(start, stop) for start, stop in itertools.pairwise(edges)]
    return list(zip(intervals, directions, strict=True))


def _find_reversals(pressure: Array, threshold: float) -> Iterator[tuple[int, int]]:
    """First row and direction of each branch; the first direction is known once the pressure has
    moved.
    """
    direction = 0
    extreme = 0
    low = high = 0
    values = pressure.tolist()
    for i, value in enumerate(values):
        if direction == 0:
            low = i if value < values[low] else low
            high = i if value > values[high] else high
            if values[high] - values[low] >= threshold:
                direction, extreme = (1, high) if high > low else (-1, low)
                yield 0, direction
        elif direction * (value - values[extreme]) >= 0.0:
            extreme = i
        elif direction * (values[extreme] - value) >= threshold:
            # of a dwell at the extreme
            level = values[extreme]
            band = EXIT_FRACTION * threshold
            dwell = (j for j in range(extreme, i) if direction * (level - values[j]) < band)
            yield max(dwell, default=extreme) + 1, -direction
            direction = -direction
            extreme = i


def branch_directions(recording: Recording, branches: tuple[Branch, ...]) -> Array:
    """The direction (N,) of each row: 1 inflating or contracting, -1 deflating or extending, 0
    outside.
    """
    signs = np.zeros(len(recording))
    for branch in branches:
        signs[branch.interval.rows] = branch.direction
    return signs


def branch_column_agreement(recording: Recording, branches: tuple[Branch, ...]) -> float | None:
    """Fraction of rows that agree with the branch column of the file (1 inflating, 2 deflating);
    None without it. None also for branches of a motion at constant pressure."""
    if "branch" not in recording or any(branch.column != "pressure" for branch in branches):
        return None
    return float(
        np.mean(
            np.where(recording["branch"] == 1, 1.0, -1.0) == branch_directions(recording, branches)
        )
    )
