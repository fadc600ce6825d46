"""Sensors and sampling of a recording: resolution, noise and limits; sample time, jitter, gaps,
repeated times.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array
from ...recording.columns import quantity_of
from ...recording.recording import Recording
from .interval import EDGE, Mask, find_static_points, level_intervals, remembered, true_intervals
from .resolution import (
    ROUNDING,
    SAME_READING,
    constant_band,
    estimate_resolution,
    rounding,
    time_rounding,
)

GAP_FACTOR = 5.0
"""A time step longer than this multiple of the sample time is a gap (chosen)."""


@dataclasses.dataclass(frozen=True)
class Gap:
    """A gap between row `row` and the next row, of length `duration` [s]."""

    row: int
    duration: float


@dataclasses.dataclass(frozen=True)
class Sampling:
    """Number of rows, duration [s], sample time [s], jitter as a fraction of the median step, and
    irregularities.

    The sample time is the median step; where time stamps repeat without decreasing, as rounded ones
    do, the mean step. Rows are counted from 0; the time of `repeated_rows` equals that of the row
    before, `backward_rows` have an earlier.
    """

    rows: int
    duration: float
    sample_time: float
    jitter: float
    gaps: tuple[Gap, ...] = ()
    repeated_rows: tuple[int, ...] = ()
    backward_rows: tuple[int, ...] = ()

    @property
    def rate(self) -> float:
        """Sampling rate [1/s]."""
        return 1.0 / self.sample_time if self.sample_time > 0 else float("nan")

    @property
    def rounded(self) -> bool:
        """Whether time stamps repeat and none decreases, as those of a logger that rounds them."""
        return bool(self.repeated_rows) and not self.backward_rows


def analyse_sampling(recording: Recording) -> Sampling | None:
    """The sampling of a recording; None without time or with fewer than two rows."""
    if "time" not in recording or len(recording) < 2:
        return None
    time = recording["time"]
    steps = _time_steps(time)
    forward = steps[steps > 0]
    step = float(np.median(forward)) if forward.size else 0.0
    jitter = 1.4826 * float(np.median(np.abs(forward - step))) / step if step else 0.0
    gaps = tuple(Gap(int(i), float(steps[i])) for i in np.flatnonzero(steps > GAP_FACTOR * step))
    repeated, backward = (
        tuple((np.flatnonzero(wrong) + 1).tolist()) for wrong in (steps == 0, steps < 0)
    )
    sample_time = _sample_time(steps)
    duration = float(time.max() - time.min())
    return Sampling(
        len(recording), duration, sample_time, jitter, gaps if step else (), repeated, backward
    )


def _time_steps(time: Array) -> Array:
    """The steps of time stamps, 0 between equal ones."""
    steps = np.diff(time)
    return np.where(np.abs(steps) <= time_rounding(time), 0.0, steps)


def _sample_time(steps: Array) -> float:
    """The median step that is not zero, of rounded time stamps the mean step outside gaps; 0 if
    time stands still.
    """
    if not (steps > 0).any():
        return 0.0
    median = float(np.median(steps[steps > 0]))
    is_rounded = not (steps > 0).all() and not (steps < 0).any()
    return float(steps[steps <= GAP_FACTOR * median].mean()) if is_rounded else median


def count_rows(seconds: float, time: Array | None, min_rows: int) -> int:
    """The number of rows in a time span, at most all; `min_rows` without time or if the rows are
    far apart.
    """
    if time is None or len(time) < 2:
        return min_rows
    sample_time = _sample_time(_time_steps(time))
    if not sample_time:
        return min_rows
    count = min(seconds / sample_time, len(time))
    return max(min_rows, round(count * (1.0 - EDGE)))  # half a row is none, whatever the rounding


MIN_NOISE = 0.2
"""Minimum noise, in units of the resolution, at which readings vary (chosen)."""
MIN_SATURATED_ROWS = 5
"""Minimum number of consecutive rows that show saturation (chosen)."""
MIN_SHARE_AT_TOP = 0.25
"""Minimum share of the readings of a saturated interval at their maximum, where they jitter by one
count (chosen): of a held value with noise, few are.
"""
_IGNORED = ("time", "branch", "fill", "discharge", "latched")


@dataclasses.dataclass(frozen=True)
class Sensor:
    """The sensor of a column: resolution (0 if not detectable), noise and saturation limits, in SI
    units.

    `lower_limit` and `upper_limit` are the readings at which the sensor saturates, infinite if it
    does not.
    """

    name: str
    resolution: float
    noise: float
    lower_limit: float = -math.inf
    upper_limit: float = math.inf
    rounding: float = 0.0
    """Difference of two readings that rounding explains."""

    @property
    def tolerance(self) -> float:
        """The difference up to which two readings are of the same count."""
        return max(SAME_READING * self.resolution, self.rounding)

    @property
    def jitter(self) -> float:
        """The difference up to which two readings may be of the same value: one count, with the
        tolerance of a reading.
        """
        return self.resolution + self.tolerance

    @property
    def std(self) -> float:
        """Standard deviation of one reading from noise and quantisation; its inverse is the weight
        in a fit.
        """
        return math.hypot(self.noise, self.resolution / math.sqrt(12.0))

    def censoring(self, values: Array) -> Array:
        """The censoring (N,) of readings (N,): 0 measured, 1 at the lower limit (true value below),
        -1 at the upper.
        """
        at_lower = values <= self.lower_limit + self.tolerance
        at_upper = values >= self.upper_limit - self.tolerance
        return at_lower * 1.0 - at_upper * 1.0


@remembered
def estimate_sensors(recordings: Recording | Sequence[Recording]) -> Mapping[str, Sensor]:
    """The sensors of the columns of a recording, or of several recordings from one test rig, by
    column name.

    Several recordings show the limits more reliably, because a single run may hardly reach them.
    Resolution and noise are medians over the recordings that have rows. Static points
    (`find_static_points`) show the resolution only.
    """
    sequence = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    several = [recording for recording in sequence if len(recording)]
    names = dict.fromkeys(
        n for r in several for n in r.columns if n.rpartition(".")[2] not in _IGNORED
    )
    parts = several, [recording for recording in several if find_static_points(recording) is None]
    return {
        name: _estimate_sensor(
            name, *([r.columns[name] for r in part if name in r.columns] for part in parts)
        )
        for name in filter(quantity_of, names)
    }


def _estimate_sensor(name: str, all_runs: list[Array], runs: list[Array]) -> Sensor:
    """The sensor of a column: its resolution from all runs, the rest from those whose order has a
    meaning.
    """
    steps = [
        step
        for values in all_runs
        if (step := estimate_resolution(values, constant_band(name, values)))
    ]
    together = steps or len(all_runs) == 1
    resolution = (
        float(np.median(steps or 0.0))
        if together
        else estimate_resolution(np.concatenate(all_runs))
    )
    least = max((rounding(name, values) for values in all_runs), default=0.0)
    sensor = Sensor(name, resolution, 0.0, rounding=least)
    if not runs:
        return sensor
    low = -_upper_limit([-values for values in runs], sensor)
    high = _upper_limit(runs, sensor)
    sensor = dataclasses.replace(sensor, lower_limit=low, upper_limit=high)
    noise = float(
        np.median([estimate_noise(values[sensor.censoring(values) == 0.0]) for values in runs])
    )
    return dataclasses.replace(sensor, noise=noise)


def estimate_noise(values: Array) -> float:
    """The robust standard deviation of white noise on a slowly varying signal; 0 for fewer than
    five rows.
    """
    if len(values) < 5:
        return 0.0
    second = values[:-2] - 2.0 * values[1:-1] + values[2:]
    noise = float(1.4826 * np.median(np.abs(second)) / math.sqrt(6.0))
    return noise if noise > ROUNDING * float(np.max(np.abs(values))) else 0.0


def _upper_limit(runs: list[Array], sensor: Sensor) -> float:
    """The upper limit at which readings stay for many more rows than elsewhere; infinite without
    saturation. Readings at the limit may jitter by one count: the limit is then the lower one of
    the two.
    """
    limits = [0.0, sensor.resolution] if sensor.resolution > 0.0 else [0.0]
    top = max(float(values.max()) for values in runs)
    for below in limits:
        if _stays_at_top(runs, sensor, below):
            return top - below
    return math.inf


def _stays_at_top(runs: list[Array], sensor: Sensor, below: float) -> bool:
    """Whether the readings stay within `below` of their maximum for many more rows than in a band
    of this width elsewhere, and are not just without noise.
    """
    combined = np.concatenate(runs)
    top = float(combined.max())
    tolerance = sensor.tolerance
    edge = top - below - tolerance
    stays = [
        (values, max(true_intervals(values >= edge), key=len, default=None)) for values in runs
    ]
    values, longest = max(stays, key=lambda stay: len(stay[1] or ()))
    if longest is None or len(longest) < MIN_SATURATED_ROWS or not (combined < edge).any():
        return False
    at_limit = values[longest.rows]
    if float(np.mean(at_limit >= top - tolerance)) < MIN_SHARE_AT_TOP:
        return False
    between = [
        values[(values < edge) & (values > combined.min() + below + tolerance)] for values in runs
    ]
    band = below + tolerance
    rows_elsewhere = 1 + max(
        _longest_interval(np.abs(np.diff(values)) <= tolerance)
        if not below
        else max((len(level) for level in level_intervals(values, band)), default=0)
        for values in between
    )
    noise = max(estimate_noise(values) for values in between)
    is_noisy = noise > max(MIN_NOISE * sensor.resolution, 1e-6 * float(np.ptp(combined)))
    return is_noisy and len(longest) > 2 * rows_elsewhere


def _longest_interval(mask: Mask) -> int:
    """The length of the longest interval of true rows."""
    return max((len(interval) for interval in true_intervals(mask)), default=0)
