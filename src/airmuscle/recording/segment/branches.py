"""Inflating and deflating branches, from the pressure's own history.

The pressure turns where it has come back from an extreme by more than `swing` of its range; smaller ripples belong
to the branch that they lie on. A rest at the top belongs to the branch that led there, because friction remembers it:
the turn is put at the last row before the pressure leaves the level of the rest. A branch column of a file decides
nothing; `agreement` compares with it.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .sampling import count_rows
from .sensor import Sensor
from .interval import Interval, running_median

REVERSAL_FRACTION = 0.05
"""The part of the range by which the pressure must come back before it has turned (chosen)."""
SPIKE_DURATION = 0.15
"""Overshoots of a valve's pulse shorter than this [s] are no turn (chosen)."""
EXIT_FRACTION = 0.25
"""The part of a swing after which a rest is over (chosen)."""


@dataclasses.dataclass(frozen=True)
class Branch:
    """Rows on which the muscle is inflating (direction 1) or deflating (-1), with pressures at both ends [Pa]."""

    interval: Interval
    direction: int
    start_pressure: float
    end_pressure: float

    @property
    def name(self) -> str:
        """`inflating` or `deflating`."""
        return "inflating" if self.direction > 0 else "deflating"


def find_branches(
    recording: Recording, sensor: Sensor | None = None, *, swing: float = REVERSAL_FRACTION
) -> tuple[Branch, ...]:
    """The branches of a recording in their order; none where the pressure does not move or is not there.

    A turn needs `swing` of the pressure's range and ten deviations of the sensor. Without time, the order of the rows
    is taken for the history.
    """
    if "pressure" not in recording or len(recording) < 3:
        return ()
    calm = _remove_spikes(recording["pressure"], recording.columns.get("time"))
    found = _monotonic_intervals(calm, max(swing * float(np.ptp(calm)), 10.0 * (sensor.std if sensor else 0.0)))
    return tuple(_make_branch(calm, stretch, direction) for stretch, direction in found)


def motion_direction(values: Array, time: Array | None = None, *, swing: float = REVERSAL_FRACTION) -> Array:
    """By row of any path: 1 where it rises, -1 where it falls, told as branches are told from the pressure.

    0 throughout where it does not move.
    """
    calm = _remove_spikes(values, time)
    signs = np.zeros(len(values))
    for stretch, direction in _monotonic_intervals(calm, swing * float(np.ptp(calm)) if len(calm) else 0.0):
        signs[stretch.rows] = direction
    return signs


def _remove_spikes(values: Array, time: Array | None) -> Array:
    return values if time is None else running_median(values, 2 * count_rows(SPIKE_DURATION / 2.0, time, 1) + 1)


def _monotonic_intervals(calm: Array, least: float) -> list[tuple[Interval, int]]:
    """The stretches between turns, each with its direction; none where all stays within `least`."""
    if not len(calm) or not float(np.ptp(calm)) > least:
        return []
    turns = list(_find_reversals(calm, least))
    starts = [0, *(row for row, _ in turns[1:]), len(calm)]
    pairs = zip(itertools.pairwise(starts), turns, strict=True)
    return [(Interval(a, b), direction) for (a, b), (_, direction) in pairs]


def _find_reversals(pressure: Array, least: float) -> Iterator[tuple[int, int]]:
    """The rows at which branches begin, and their directions; the first is known once the pressure has moved."""
    direction, extreme = 0, 0
    low = high = 0
    values = pressure.tolist()
    for i, value in enumerate(values):
        if direction == 0:
            low, high = (i if value < values[low] else low), (i if value > values[high] else high)
            if values[high] - values[low] >= least:
                direction, extreme = (1, high) if high > low else (-1, low)
                yield 0, direction
        elif direction * (value - values[extreme]) >= 0.0:
            extreme = i
        elif direction * (values[extreme] - value) >= least:
            yield _end_of_dwell(values, extreme, i, direction, least), -direction
            direction, extreme = -direction, i


def _end_of_dwell(values: list[float], extreme: int, here: int, direction: int, least: float) -> int:
    """The first row that has left the level of the extreme, between it and the row that shows the turn."""
    last = max(
        (j for j in range(extreme, here) if direction * (values[extreme] - values[j]) < EXIT_FRACTION * least),
        default=extreme,
    )
    return last + 1


def _make_branch(pressure: Array, stretch: Interval, direction: int) -> Branch:
    return Branch(stretch, direction, float(pressure[stretch.start]), float(pressure[stretch.stop - 1]))


def branch_directions(recording: Recording, found: tuple[Branch, ...]) -> Array:
    """By row: 1 inflating, -1 deflating, 0 where no branch was found."""
    signs = np.zeros(len(recording))
    for branch in found:
        signs[branch.interval.rows] = branch.direction
    return signs


def branch_column_agreement(recording: Recording, found: tuple[Branch, ...]) -> float | None:
    """The part of the rows on which a file's own branch column (1 inflating, 2 deflating) says the same."""
    if "branch" not in recording:
        return None
    stated = np.where(recording["branch"] == 1, 1.0, -1.0)
    return float(np.mean(stated == branch_directions(recording, found)))
