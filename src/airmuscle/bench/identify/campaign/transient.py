"""Transients of a record: steps of the pressure of fills and discharges, and the single fast motion of a release."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping

import numpy as np

from ....core.arrays import Array
from ....recording import Recording
from ...segment import Sensor, quasi_static_rows
from ...segment.interval import Mask, running_median
from ...segment.runs import CONTRACTION_BAND

MIN_STEP = 20e3
"""Minimum change of the pressure of a step [Pa] (chosen)."""
MAX_MIDDLE = 0.47
"""Maximum time of half the change of a step, as a fraction of the time from 5 % to 95 %; 0.5 is a ramp (chosen)."""
MIN_TRANSIENT = 0.5
"""Minimum fraction of the rows of a step that are not quasi-static (chosen)."""
MAX_PULSES = 2
"""Maximum number of rises after a rest within a step (chosen); more are the pulses of a valve that makes a ramp."""
PULSE_POINTS, PULSE_WINDOW = 200, 4
"""Number of points of a step, and of those of a moving difference, by which pulses are counted (chosen)."""
MAX_RELEASE = 2.0
"""Maximum duration of the motion of a release [s] (chosen)."""
MEDIAN_ROWS = 5
"""Width of the moving median of the pressure and the length, in rows (chosen)."""


@dataclasses.dataclass(frozen=True)
class PressureStep:
    """A step of the pressure: instant of its start [s], duration from 5 % to 95 % [s], and change [Pa]."""

    start: float
    duration: float
    change: float
    final_pressure: float
    """Gauge pressure at the end of the step [Pa]."""


@dataclasses.dataclass(frozen=True)
class Motion:
    """The motion of a record: start and end [s] between 2 % and 95 % of its net travel [m]."""

    start: float
    end: float
    travel: float
    range: float
    """Range of the displacement in the record [m]."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.end - self.start

    @property
    def is_single(self) -> bool:
        """Whether the muscle was moved once, and not back."""
        return abs(self.travel) > 0.5 * self.range

    @property
    def is_fast(self) -> bool:
        """Whether the motion is that of a release, not of a slow run."""
        return self.duration < MAX_RELEASE


def find_pressure_steps(recording: Recording, sensors: Mapping[str, Sensor]) -> tuple[PressureStep, ...]:
    """The steps of the pressure through a valve; empty for a slow or a linear change of the pressure.

    Each step approaches its final value with a decreasing rate, so that half of the change takes less than half of the
    time.
    """
    time, pressure = recording["time"], running_median(recording["pressure"], MEDIAN_ROWS)
    low, high = float(pressure.min()), float(pressure.max())
    if high - low < MIN_STEP or not (np.diff(time) > 0).all():
        return ()
    fraction = (pressure - low) / (high - low)
    transient = ~quasi_static_rows(recording, sensors)
    above = _with_dead_band(fraction)
    crossings = np.flatnonzero(np.diff(above.astype(int)))
    ends: list[int] = [0, *(int((a + b) // 2) for a, b in itertools.pairwise(crossings.tolist())), time.size - 1]
    steps = []
    for i, crossing in enumerate(crossings):
        rows = np.arange(ends[i], ends[i + 1] + 1)
        step = _measure(time[rows], fraction[rows], transient[rows], rising=bool(above[crossing + 1]))
        if step is None:
            return ()
        start, duration, first, last = step
        steps.append(PressureStep(start, duration, (last - first) * (high - low), low + last * (high - low)))
    return tuple(steps)


def _with_dead_band(fraction: Array) -> Mask:
    """Whether the fraction is in its upper half, with a dead band of a fifth of the range."""
    state, states = bool(fraction[0] > 0.5), []
    for value in fraction.tolist():
        state = value > 0.4 if state else value > 0.6
        states.append(state)
    return np.array(states)


def _measure(time: Array, fraction: Array, transient: Mask, rising: bool) -> tuple[float, float, float, float] | None:
    """Start, duration, first and last value of a step; None if it is not that of a valve."""
    values = fraction if rising else 1.0 - fraction
    first, last = float(np.min(values)), float(np.max(values))
    marks = [first + share * (last - first) for share in (0.05, 0.5, 0.95)]
    begin = int(np.flatnonzero(values <= marks[0])[-1]) if (values <= marks[0]).any() else 0
    later = [begin + int(np.argmax(values[begin:] >= mark)) for mark in marks[1:]]
    duration = float(time[later[1]] - time[begin])
    half = float(time[later[0]] - time[begin])
    if later[1] <= begin or transient[begin : later[1] + 1].mean() < MIN_TRANSIENT or half > MAX_MIDDLE * duration:
        return None
    step_rows = slice(begin, later[1] + 1)
    if count_pulses(time[step_rows], values[step_rows]) > MAX_PULSES:
        return None
    slope = (values[later[0]] - values[begin]) / max(half, 1e-9)
    start = float(time[begin]) - float(values[begin] - first) / max(float(slope), 1e-9)
    ends = (first, last) if rising else (1.0 - first, 1.0 - last)
    return max(start, float(time[0])), duration, *ends


def count_pulses(time: Array, values: Array) -> int:
    """Number of rises above the mean rate after a rest, in a rising signal; a fill through an open valve has none."""
    even = np.interp(np.linspace(time[0], time[-1], PULSE_POINTS), time, values)
    mean = PULSE_WINDOW * float(even[-1] - even[0]) / PULSE_POINTS
    changes = even[PULSE_WINDOW:] - even[:-PULSE_WINDOW]
    marked = np.where(changes > 1.5 * mean, 1, np.where(changes < 0.3 * mean, -1, 0))
    known = marked[marked != 0]
    return int(np.count_nonzero(np.diff(known) > 0))


def find_motion(recording: Recording) -> Motion | None:
    """The motion of a record from its first to its last length; None if the length is constant."""
    contraction = running_median(recording["contraction"], MEDIAN_ROWS)
    span = float(np.ptp(contraction))
    if span <= CONTRACTION_BAND:
        return None
    rows = max(1, contraction.size // 50)
    first, last = float(np.median(contraction[:rows])), float(np.median(contraction[-rows:]))
    travel, time = last - first, recording["time"]
    length = float(recording.constants.get("resting_length", 1.0))
    if abs(travel) <= CONTRACTION_BAND:
        return Motion(float(time[0]), float(time[-1]), travel * length, span * length)
    fraction = (contraction - first) / travel
    begin = int(np.argmax(fraction > 0.02))
    outside = np.flatnonzero(np.abs(fraction - 1.0) > 0.05)
    end = int(outside[-1]) + 1 if outside.size else begin
    return Motion(float(time[begin]), float(time[min(end, time.size - 1)]), travel * length, span * length)
