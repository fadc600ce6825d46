"""What a sensor can tell, estimated from what it told: resolution, noise, and the ends where it is cut off.

A resolution is the step of which all differences between readings are multiples. Noise is the robust spread of
second differences, which no slow course of the quantity reaches. An end is taken for a cut-off where the readings
stay exactly at their extreme although they flicker everywhere else.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core.arrays import Array
from ..columns import quantity_of
from ..recording import Recording
from .interval import Mask, true_intervals

MIN_DISTINCT_VALUES = 15
"""Distinct readings from which on a step is a sensor's and not that of the settings of a test (chosen)."""
MAX_RMS_OFFSET = 0.12
"""Greatest rms distance of differences from multiples of the step, in steps (chosen; random ones have 0.29)."""
SAME_READING = 0.05
"""Readings closer than this part of a step are one reading (chosen)."""
MIN_NOISE = 0.2
"""Noise in resolutions from which on readings flicker (chosen)."""
ROUNDING_ERROR = 1e-9
"""Noise below this part of the readings is that of computing (chosen)."""
MIN_SATURATED_ROWS = 5
"""The fewest rows behind each other that show a cut-off (chosen)."""
_IGNORED = ("time", "branch", "fill", "discharge", "held")


@dataclasses.dataclass(frozen=True)
class Sensor:
    """A column's sensor in the column's SI unit: resolution (0 where none shows), noise, and its two ends.

    `lower_limit` and `upper_limit` are readings at which it is cut off, infinite where it is not; `at_lower_limit` and
    `at_upper_limit` count the rows that stand there.
    """

    name: str
    resolution: float
    noise: float
    lower_limit: float = -math.inf
    upper_limit: float = math.inf
    at_lower_limit: int = 0
    at_upper_limit: int = 0

    @property
    def std(self) -> float:
        """Standard deviation of one reading: noise, and rounding to the resolution; what weights come from."""
        return math.hypot(self.noise, self.resolution / math.sqrt(12.0))

    def censoring(self, values: Array) -> Array:
        """By row: 0 measured, 1 cut off below (the truth is less), -1 cut off above."""
        near = 0.25 * self.resolution
        return (values <= self.lower_limit + near) * 1.0 - (values >= self.upper_limit - near) * 1.0


def estimate_sensors(recordings: Recording | Sequence[Recording]) -> Mapping[str, Sensor]:
    """The sensors behind the columns of a recording, or of several that come from one rig.

    Ends show better in several: one run may hardly reach an end. Resolution and noise are the median of the runs.
    """
    several = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    names = dict.fromkeys(n for r in several for n in r.columns if n.rpartition(".")[2] not in _IGNORED)
    return {
        name: _estimate_sensor(name, [r.columns[name] for r in several if name in r.columns])
        for name in names
        if quantity_of(name)
    }


def _estimate_sensor(name: str, runs: list[Array]) -> Sensor:
    seen = [step for values in runs if (step := estimate_resolution(values))]
    resolution = float(np.median(seen)) if seen else estimate_resolution(np.concatenate(runs))
    low, at_low = _upper_limit([-v for v in runs], resolution)
    high, at_high = _upper_limit(runs, resolution)
    sensor = Sensor(name, resolution, 0.0, -low, high, at_low, at_high)
    noise = float(np.median([estimate_noise(values[sensor.censoring(values) == 0.0]) for values in runs]))
    return dataclasses.replace(sensor, noise=noise)


def estimate_noise(values: Array) -> float:
    """The robust standard deviation of white noise on a slow course; 0 for fewer than five rows."""
    if len(values) < 5:
        return 0.0
    second = values[:-2] - 2.0 * values[1:-1] + values[2:]
    noise = float(1.4826 * np.median(np.abs(second)) / math.sqrt(6.0))
    return noise if noise > ROUNDING_ERROR * float(np.max(np.abs(values))) else 0.0


def estimate_resolution(values: Array) -> float:
    """The largest step of which the differences of neighbouring readings are multiples; 0 where there is none."""
    distinct = np.unique(values)
    if len(distinct) < MIN_DISTINCT_VALUES:
        return 0.0
    gaps = np.diff(distinct)
    candidates = sorted({float(q) for q in np.quantile(gaps, [0.02, 0.1, 0.25, 0.5])}, reverse=True)
    for candidate in candidates:
        # One reading may be printed in two ways, 71.70 and 71.71: such twins count as one.
        steps = np.diff(distinct[np.concatenate(([True], gaps > SAME_READING * candidate))])
        step = _refine_step(candidate, steps[steps < 8.5 * candidate])
        if step > 0.0 and _are_multiples(steps, step):
            return step
    return 0.0


def _refine_step(step: float, differences: Array) -> float:
    """The step that fits differences of a few steps best, by least squares; 0 where none is one step."""
    for _ in range(3):
        counts = np.round(differences / step)
        total = float(counts @ counts)
        if total == 0.0:
            return 0.0
        step = float(counts @ differences) / total
    return step


def _are_multiples(steps: Array, step: float) -> bool:
    """Whether nearly all small differences are whole multiples, and enough of them one or two, not by chance."""
    small = steps[steps < 8.5 * step] / step
    off = small - np.round(small)
    enough = len(small) >= 10 and np.count_nonzero(np.round(small) == 1) >= 3
    return bool(enough and np.sqrt(np.mean(off**2)) < MAX_RMS_OFFSET and np.mean(np.round(small) > 0) > 0.98)


def _upper_limit(runs: list[Array], resolution: float) -> tuple[float, int]:
    """The upper end at which readings are cut off, and how many stand there; infinite where they are not.

    The readings must stay there without flicker, row after row, much longer than on any other reading, and the
    sensor must have noise that shows elsewhere.
    """
    everything = np.concatenate(runs)
    top, near = float(everything.max()), 0.25 * resolution
    there = [values >= top - near for values in runs]
    below = everything[everything < top - near]
    if not len(below):
        return math.inf, 0
    count = len(everything) - len(below)
    stays = max(_longest_interval(mask) for mask in there)
    between = [values[(values < top - near) & (values > everything.min() + near)] for values in runs]
    elsewhere = max(_longest_constant(values, near) for values in between)
    noise = max(estimate_noise(values) for values in between)
    shows = noise > max(MIN_NOISE * resolution, 1e-6 * float(np.ptp(everything)))
    cut_off = shows and stays >= MIN_SATURATED_ROWS and stays > 2 * elsewhere
    return (top, count) if cut_off else (math.inf, 0)


def _longest_interval(mask: Mask) -> int:
    """The length of the longest stretch of true rows."""
    return max((len(stretch) for stretch in true_intervals(mask)), default=0)


def _longest_constant(values: Array, near: float) -> int:
    """The most rows behind each other that hold one reading."""
    return 1 + _longest_interval(np.abs(np.diff(values)) <= near)
