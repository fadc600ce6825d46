"""Transients of a record, steps of the pressure and the motion of a release, and its rows for
fits.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array
from ...recording import Recording
from ..inspection import (
    CONTRACTION_BAND,
    Mask,
    Sensor,
    estimate_noise,
    quasi_static_rows,
    running_median,
)
from ..prediction import thinned_rows

NOISE_RANGE = 8.0
"""Range of the noise of a held contraction, in standard deviations of the noise (chosen)."""


@dataclasses.dataclass(frozen=True)
class LeftOutStage:
    """A stage without a result: its name, the reason, and what to measure, as phrases."""

    name: str
    reason: str
    remedy: str

    @property
    def verdict(self) -> str:
        """The reason, as a sentence; what to measure is in the table of the next experiments."""
        return f"Not identified: {self.reason.rstrip('.')}."


def thin(recording: Recording, count: int) -> Recording:
    """The recording reduced to at most `count` rows, evenly spaced by number."""
    return (
        recording
        if len(recording) <= count
        else recording.rows(thinned_rows(len(recording), count))
    )


def is_held(recording: Recording) -> bool:
    """Whether the length of a recording is held: its contraction stays within the band of an
    isometric run.
    """
    path = recording["contraction"]
    return float(
        np.nanmax(path) - np.nanmin(path)
    ) <= CONTRACTION_BAND + NOISE_RANGE * estimate_noise(path)


def with_force(recording: Recording, added: Array) -> Recording:
    """The recording with a force added to the measured one; rows without tension stay at zero."""
    force = recording["force"]
    return recording.with_columns(force=np.where(force > 0.0, force + added, force))


def named(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings with different origins: repeated names are numbered."""
    names = [recording.origin for recording in recordings]
    return tuple(
        (
            recording
            if names.count(recording.origin) == 1
            else dataclasses.replace(recording, origin=f"{recording.origin} ({i + 1})")
        )
        for i, recording in enumerate(recordings)
    )


MIN_STEP = 20e3
MAX_MIDDLE = 0.47
MIN_TRANSIENT = 0.5
"""Minimum change of the pressure of a step [Pa], maximum time of half of it, as a fraction of the
time from 5 to 95 %, which is 0.5 in a ramp, and minimum fraction of its rows that are not
quasi-static (chosen)."""
MAX_PULSES = 2
"""Maximum number of rises after a rest within a step (chosen); more are the pulses of a valve that
makes a ramp.
"""
PULSE_POINTS = 200
PULSE_WINDOW = 4
"""Number of points of a step, and of those of a moving difference, by which pulses are counted
(chosen).
"""
MAX_RELEASE = 2.0
MEDIAN_ROWS = 5
"""Maximum duration of the motion of a release [s], and width of the median of pressure and length
[rows] (chosen).
"""


@dataclasses.dataclass(frozen=True)
class PressureStep:
    """A step of the pressure: instant of its start [s], duration from 5 % to 95 % [s], change, and
    value at its end [Pa]."""

    start: float
    duration: float
    change: float
    final_pressure: float


@dataclasses.dataclass(frozen=True)
class Motion:
    """The motion of a record: start and end [s] between 2 % and 95 % of its net travel [m], range
    of its path [m].
    """

    start: float
    end: float
    travel: float
    range: float

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.end - self.start


def find_pressure_steps(
    recording: Recording, sensors: Mapping[str, Sensor]
) -> tuple[PressureStep, ...]:
    """The steps of the pressure through a valve; empty for a slow or a linear change of the
    pressure. Each step approaches its final value with a decreasing rate, so that half of the
    change takes less than half of the time.
    """
    time = recording["time"]
    pressure = running_median(recording["pressure"], MEDIAN_ROWS)
    low = float(pressure.min())
    high = float(pressure.max())
    if high - low < MIN_STEP or not (np.diff(time) > 0).all():
        return ()
    fraction = (pressure - low) / (high - low)
    transient = ~quasi_static_rows(recording, sensors)
    above = [bool(fraction[0] > 0.5)]  # in the upper half, with a dead band of a fifth of the range
    for value in fraction.tolist():
        above.append(value > (0.4 if above[-1] else 0.6))
    crossings = np.flatnonzero(np.diff(above[1:])).tolist()
    ends: list[int] = [0, *((a + b) // 2 for a, b in itertools.pairwise(crossings)), time.size - 1]
    steps = []
    for crossing, (a, b) in zip(crossings, itertools.pairwise(ends), strict=True):
        rows = slice(a, b + 1)
        course = _measure(time[rows], fraction[rows], transient[rows], rising=above[crossing + 2])
        if course is None:
            return ()
        change = (course.last - course.first) * (high - low)
        final_pressure = low + course.last * (high - low)
        steps.append(PressureStep(course.start, course.duration, change, final_pressure))
    return tuple(steps)


class _Course(NamedTuple):
    """The course of a step: start and duration [s], and its first and its last value."""

    start: float
    duration: float
    first: float
    last: float


def _measure(time: Array, fraction: Array, transient: Mask, rising: bool) -> _Course | None:
    """The course of a step; None if it is not that of a valve."""
    values = fraction if rising else 1.0 - fraction
    first = float(np.min(values))
    last = float(np.max(values))
    change = last - first
    at_first = np.flatnonzero(values <= first + 0.05 * change)
    begin = int(at_first[-1]) if at_first.size else 0
    middle = begin + int(np.argmax(values[begin:] >= first + 0.5 * change))
    end = begin + int(np.argmax(values[begin:] >= first + 0.95 * change))
    duration = float(time[end] - time[begin])
    half = float(time[middle] - time[begin])
    rows = slice(begin, end + 1)
    if end <= begin or half > MAX_MIDDLE * duration:
        return None
    if transient[rows].mean() < MIN_TRANSIENT:
        return None
    if count_pulses(time[rows], values[rows]) > MAX_PULSES:
        return None
    slope = float((values[middle] - values[begin]) / max(half, 1e-9))
    start = float(time[begin]) - float(values[begin] - first) / max(slope, 1e-9)
    start = max(start, float(time[0]))
    if not rising:
        return _Course(start, duration, 1.0 - first, 1.0 - last)
    return _Course(start, duration, first, last)


def count_pulses(time: Array, values: Array) -> int:
    """Number of rises above the mean rate after a rest, in a rising signal; a fill through an open
    valve has none.
    """
    even_times = np.linspace(time[0], time[-1], PULSE_POINTS)
    even = np.interp(even_times, time, values)
    mean = PULSE_WINDOW * float(even[-1] - even[0]) / PULSE_POINTS
    changes = even[PULSE_WINDOW:] - even[:-PULSE_WINDOW]
    is_rest = changes < 0.3 * mean
    is_rise = changes > 1.5 * mean
    marked = np.where(is_rise, 1, np.where(is_rest, -1, 0))
    known = marked[marked != 0]
    return int(np.count_nonzero(np.diff(known) > 0))


def find_motion(recording: Recording) -> Motion | None:
    """The motion of a record from its first to its last length; None if the length is constant."""
    contraction = running_median(recording["contraction"], MEDIAN_ROWS)
    span = float(np.ptp(contraction))
    if span <= CONTRACTION_BAND:
        return None
    rows = max(1, contraction.size // 50)
    time = recording["time"]
    first = float(np.median(contraction[:rows]))
    last = float(np.median(contraction[-rows:]))
    travel = last - first
    begin = 0
    end = time.size - 1
    if abs(travel) > CONTRACTION_BAND:
        fraction = (contraction - first) / travel
        begin = int(np.argmax(fraction > 0.02))
        outside = np.flatnonzero(np.abs(fraction - 1.0) > 0.05)
        end = min(int(outside[-1]) + 1 if outside.size else begin, end)
    length = float(recording.constants.get("resting_length", 1.0))
    return Motion(float(time[begin]), float(time[end]), travel * length, span * length)
