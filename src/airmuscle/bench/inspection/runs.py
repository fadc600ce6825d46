"""Runs: intervals of a recording in which one quantity is constant while others are swept.

A run with constant pressure is isobaric, with constant length or contraction isometric, with
constant force isotonic. A quantity is constant if it stays within `RELATIVE_BAND` of its maximum
(within `CONTRACTION_BAND` for a contraction), or within the noise of its sensor. A run is isotonic
only if its motion was measured. A file may contain many consecutive runs, as tables of static
points do: these are at the levels of the quantity that explains the most rows. A pressure that only
oscillates within `RIPPLE_BAND` while the muscle is moved, the ripple of its regulator, counts as
constant.
"""

import dataclasses
import itertools
from collections import deque
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...recording.columns import MOVED
from ...recording.recording import Recording
from .interval import (
    Interval,
    StaticPoints,
    find_static_points,
    level_intervals,
    remembered,
    spread,
)
from .resolution import constant_band
from .sensor import Sensor, estimate_sensors

RIPPLE_BAND = 0.06
MIN_RIPPLE_REVERSALS = 3
"""Band of a pressure that oscillates while the muscle is moved, as a fraction of its maximum, and
number of crossings of the mean that makes a fluctuation a ripple, not a step between two levels
(chosen)."""
MOVED_BANDS = 4.0
"""A muscle is moved if its length changes by more than this number of constant bands (chosen)."""
SWEEP_FRACTION = 0.1
MIN_ROWS = 3
"""Minimum change of a swept quantity, as a fraction of its range in the recording; minimum rows of
a run (chosen).
"""


@dataclasses.dataclass(frozen=True)
class RunKind:
    """Kind of a run, and the columns that may be constant in it; the first available column is
    used.
    """

    name: str
    constant_columns: tuple[str, ...]


ISOBARIC = RunKind("isobaric", ("pressure",))
ISOMETRIC = RunKind("isometric", MOVED)
ISOTONIC = RunKind("isotonic", ("force",))
AT_REST = RunKind("at rest", ())
FREE = RunKind("free", ())
KINDS = (ISOBARIC, ISOMETRIC, ISOTONIC)
"""The kinds of run with one constant quantity; in AT_REST all measured quantities are constant, in
FREE none.
"""


@dataclasses.dataclass(frozen=True)
class Run:
    """Rows of one kind of run: `constant_column` stays at `constant_value` [SI] while
    `swept_columns` change.
    """

    interval: Interval
    kind: RunKind
    constant_column: str | None
    constant_value: float | None
    swept_columns: tuple[str, ...]


@remembered
def find_runs(recording: Recording, sensors: Mapping[str, Sensor] | None = None) -> tuple[Run, ...]:
    """The runs of a recording; one run of kind FREE if no quantity is constant, none for an empty
    recording.
    """
    if not len(recording):
        return ()
    points = find_static_points(recording)
    if points is not None:
        return _runs_of_points(recording, points)
    present = {
        kind: [name for name in kind.constant_columns if name in recording] for kind in KINDS
    }
    columns = {kind: names[0] for kind, names in present.items() if names}
    bands = dict[str, float]()
    sensors = sensors or estimate_sensors(recording)
    for name in columns.values():
        least = constant_band(name, recording[name])
        bands[name] = max(least, 8.0 * sensors[name].std if name in sensors else 0.0)
    single_run = _classify(recording, Interval(0, len(recording)), columns, bands)
    if single_run.kind != FREE:
        return (single_run,)
    # without a measured motion, a constant force does not tell the kind: a slack muscle at a held
    # length has it as well
    decisive_kinds = [kind for kind in columns if kind != ISOTONIC or ISOMETRIC in columns]
    candidates = [
        runs
        for kind in decisive_kinds
        if (runs := _runs_at_levels(recording, kind, columns[kind], bands))
    ]
    return max(
        candidates, key=lambda runs: sum(len(run.interval) for run in runs), default=(single_run,)
    )


def _runs_of_points(recording: Recording, points: StaticPoints) -> tuple[Run, ...]:
    """The runs of static points at one pressure or length each, whose rows follow each other; else
    one of kind FREE.
    """
    for kind, name, levels, swept in (
        (ISOBARIC, "pressure", points.pressure_level, points.moved),
        (ISOMETRIC, points.moved, points.length_level, "pressure"),
    ):
        edges = [0, *(np.flatnonzero(np.diff(levels)) + 1).tolist(), levels.size]
        if len(edges) == int(levels.max()) + 2:
            intervals = [Interval(a, b) for a, b in itertools.pairwise(edges)]
            return tuple(
                _constant_run(recording, interval, kind, name, (swept, "force"))
                for interval in intervals
            )
    return (Run(Interval(0, levels.size), FREE, None, None, ("pressure", points.moved)),)


def _classify(
    recording: Recording, interval: Interval, names: dict[RunKind, str], bands: dict[str, float]
) -> Run:
    """The run in an interval. Of several constant quantities, pressure takes precedence, then
    length, then force.
    """

    def is_constant(kind: RunKind, name: str) -> bool:
        level = spread(recording[name][interval.rows]) <= bands[name]
        return level or (kind == ISOBARIC and _has_ripple(recording, interval, bands))

    constant = [kind for kind, name in names.items() if is_constant(kind, name)]
    swept = tuple(name for kind, name in names.items() if kind not in constant)
    isotonic_only = constant == [ISOTONIC] and ISOMETRIC not in names
    if not constant or (len(names) == 1 and swept) or (isotonic_only and swept):
        return Run(interval, FREE, None, None, swept)
    if not swept:
        return Run(interval, AT_REST, None, None, ())
    return _constant_run(recording, interval, constant[0], names[constant[0]], swept)


def _constant_run(
    recording: Recording, interval: Interval, kind: RunKind, name: str, swept: tuple[str, ...]
) -> Run:
    return Run(interval, kind, name, float(np.median(recording[name][interval.rows])), swept)


def _runs_at_levels(
    recording: Recording, kind: RunKind, name: str, bands: dict[str, float]
) -> tuple[Run, ...]:
    """The runs in which the quantity of one kind stays at a level while another quantity is
    swept.
    """
    runs = []
    intervals = list(level_intervals(recording[name], bands[name]))
    for interval in _join_ripple(recording, intervals, bands) if kind == ISOBARIC else intervals:
        ranges = {
            column: SWEEP_FRACTION * float(np.ptp(recording[column]))
            for column in bands
            if column != name
        }
        swept = tuple(
            n
            for n, part in ranges.items()
            if spread(recording[n][interval.rows]) > max(bands[n], part)
        )
        if len(interval) >= MIN_ROWS and swept:
            runs.append(_constant_run(recording, interval, kind, name, swept))
    return tuple(runs)


def moved_column(recording: Recording) -> str | None:
    """The measured column of the motion: contraction, length, shortening or position; None without
    any.
    """
    return next((name for name in MOVED if name in recording), None)


def _has_ripple(recording: Recording, interval: Interval, bands: dict[str, float]) -> bool:
    """Whether the pressure of an interval only oscillates within the band of a ripple while the
    muscle is moved.
    """
    moved = moved_column(recording)
    pressure = recording["pressure"][interval.rows]
    if moved is None or spread(pressure) > RIPPLE_BAND * float(
        np.max(np.abs(recording["pressure"]))
    ):
        return False
    if not spread(recording[moved][interval.rows]) > MOVED_BANDS * bands[moved]:
        return False
    low, high = np.quantile(pressure, [0.01, 0.99])
    distance = pressure - 0.5 * (low + high)
    side = np.sign(
        distance[np.abs(distance) > 0.1 * (high - low)]
    )  # crossings of the middle have a dead band
    return bool(np.count_nonzero(np.diff(side)) >= MIN_RIPPLE_REVERSALS)


def _join_ripple(
    recording: Recording, intervals: list[Interval], bands: dict[str, float]
) -> Iterator[Interval]:
    """The intervals at pressure levels, those between which the pressure only ripples joined to
    one.
    """
    pressure = recording["pressure"]
    i = 0
    band = RIPPLE_BAND * float(np.max(np.abs(pressure)))
    ranges = [
        (float(pressure[interval.rows].min()), float(pressure[interval.rows].max()))
        for interval in intervals
    ]
    steps = np.sign(np.diff(pressure, prepend=pressure[:1]))
    reversals = np.cumsum(
        np.concatenate(([0], np.diff(steps) != 0))
    )  # at least as many as there are crossings
    ends = _ends_within(ranges, band)
    while i < len(intervals):
        last = i
        joined = Interval(intervals[i].start, intervals[ends[i]].stop)
        turns = reversals[joined.stop - 1] - reversals[joined.start]
        if (
            ends[i] > i
            and turns >= MIN_RIPPLE_REVERSALS - 1
            and _has_ripple(recording, joined, bands)
        ):
            last = ends[i]
        yield Interval(intervals[i].start, intervals[last].stop)
        i = last + 1


def _ends_within(ranges: Sequence[tuple[float, float]], band: float) -> list[int]:
    """For each range (low, high) the last of those after it that lie with it within a band, in
    linear time.
    """
    lowest = deque[int]()
    highest = deque[int]()
    ends = list[int]()
    stop = 0
    for i in range(len(ranges)):
        while stop < len(ranges):
            low, high = ranges[stop]
            if (
                stop > i
                and max(high, ranges[highest[0]][1]) - min(low, ranges[lowest[0]][0]) > band
            ):
                break
            while lowest and ranges[lowest[-1]][0] >= low:
                lowest.pop()
            while highest and ranges[highest[-1]][1] <= high:
                highest.pop()
            lowest.append(stop)
            highest.append(stop)
            stop += 1
        ends.append(stop - 1)
        for queue in (lowest, highest):
            if queue and queue[0] == i:
                queue.popleft()
    return ends
