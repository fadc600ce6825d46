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
from .interval import Mask, find_static_points, remembered, true_intervals

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
    steps = np.diff(time)
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
    sample_time = _sample_time(np.diff(time))
    return max(min_rows, round(min(seconds / sample_time, len(time)))) if sample_time else min_rows


MIN_DISTINCT_VALUES = 15
"""Minimum number of distinct readings for a resolution; fewer may be the set points of the test
(chosen).
"""
MAX_RMS_OFFSET = 0.12
"""Maximum RMS distance of the differences from multiples of the step, in steps (chosen; random
differences: 0.29).
"""
SAME_READING = 0.05
"""Readings closer than this fraction of a step are the same reading (chosen)."""
MIN_NOISE = 0.2
"""Minimum noise, in units of the resolution, at which readings vary (chosen)."""
ROUNDING_ERROR = 1e-9
"""Noise below this fraction of the readings is rounding error (chosen)."""
MIN_SATURATED_ROWS = 5
"""Minimum number of consecutive rows that show saturation (chosen)."""
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
        tolerance = 0.25 * self.resolution
        at_lower = values <= self.lower_limit + tolerance
        at_upper = values >= self.upper_limit - tolerance
        return at_lower * 1.0 - at_upper * 1.0


@remembered
def estimate_sensors(recordings: Recording | Sequence[Recording]) -> Mapping[str, Sensor]:
    """The sensors of the columns of a recording, or of several recordings from one test rig, by
    column name.

    Several recordings show the limits more reliably, because a single run may hardly reach them.
    Resolution and noise are medians over the recordings that have rows. Static points
    (`find_static_points`) show the resolution only.
    """
    given = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    several = [recording for recording in given if len(recording)]
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
    steps = [step for values in all_runs if (step := estimate_resolution(values))]
    together = steps or len(all_runs) == 1
    resolution = (
        float(np.median(steps or 0.0))
        if together
        else estimate_resolution(np.concatenate(all_runs))
    )
    if not runs:
        return Sensor(name, resolution, 0.0)
    low = -_upper_limit([-values for values in runs], resolution)
    high = _upper_limit(runs, resolution)
    sensor = Sensor(name, resolution, 0.0, low, high)
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
    return noise if noise > ROUNDING_ERROR * float(np.max(np.abs(values))) else 0.0


def estimate_resolution(values: Array) -> float:
    """The largest step of which the differences of adjacent readings are multiples; 0 if there is
    none.
    """
    distinct = np.unique(values)
    if len(distinct) < MIN_DISTINCT_VALUES:
        return 0.0
    gaps = np.diff(distinct)
    for candidate in sorted(
        {float(q) for q in np.quantile(gaps, [0.02, 0.1, 0.25, 0.5])}, reverse=True
    ):
        # One reading may be written in two ways, 71.70 and 71.71; both count as one.
        steps = np.diff(distinct[np.concatenate(([True], gaps > SAME_READING * candidate))])
        step = candidate
        differences = steps[steps < 8.5 * candidate]
        for _ in range(3):  # the least-squares step of differences of a few steps
            counts = np.round(differences / step)
            total = float(counts @ counts)
            step = float(counts @ differences) / total if total else 0.0
            if not total:
                break
        if step > 0.0 and _are_multiples(steps, step):
            return step
    return 0.0


def _are_multiples(steps: Array, step: float) -> bool:
    """Whether nearly all small differences are integer multiples of a step, and enough of them are
    single steps.
    """
    small = steps[steps < 8.5 * step] / step
    count = len(small)
    multiples = np.round(small)
    offset = small - multiples
    if count < 10 or math.sqrt(float(offset @ offset) / count) >= MAX_RMS_OFFSET:
        return False
    return bool(
        np.count_nonzero(multiples == 1) >= 3 and np.count_nonzero(multiples > 0) > 0.98 * count
    )


def _upper_limit(runs: list[Array], resolution: float) -> float:
    """The upper limit at which readings stay for many more rows than elsewhere; infinite without
    saturation.
    """
    combined = np.concatenate(runs)
    top = float(combined.max())
    tolerance = 0.25 * resolution
    at_top = [values >= top - tolerance for values in runs]
    below = combined[combined < top - tolerance]
    rows_at_top = max(_longest_interval(mask) for mask in at_top)
    if not len(below) or rows_at_top < MIN_SATURATED_ROWS:
        return math.inf
    between = [
        values[(values < top - tolerance) & (values > combined.min() + tolerance)]
        for values in runs
    ]
    rows_elsewhere = 1 + max(
        _longest_interval(np.abs(np.diff(values)) <= tolerance) for values in between
    )
    noise = max(estimate_noise(values) for values in between)
    is_noisy = noise > max(MIN_NOISE * resolution, 1e-6 * float(np.ptp(combined)))
    return top if is_noisy and rows_at_top > 2 * rows_elsewhere else math.inf


def _longest_interval(mask: Mask) -> int:
    """The length of the longest interval of true rows."""
    return max((len(interval) for interval in true_intervals(mask)), default=0)
