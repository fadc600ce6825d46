"""Sampling of a recording: sample time, jitter, gaps, and times that repeat or decrease."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import ParameterError
from ...recording.recording import Recording

GAP_FACTOR = 5.0
"""A time step longer than this multiple of the sample time is a gap (chosen)."""


@dataclasses.dataclass(frozen=True)
class Gap:
    """A gap between row `row` and the next row, from `start` [s], of length `duration` [s]."""

    row: int
    start: float
    duration: float


@dataclasses.dataclass(frozen=True)
class Sampling:
    """Number of rows, duration [s], sample time [s], jitter as a fraction of the median step, and irregularities.

    The sample time is the median step; where time stamps repeat without decreasing, as rounded ones do, the mean step.
    Rows are counted from 0; the time of `repeated_rows` equals, and that of `backward_rows` precedes, the time of the
    previous row.
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
    gap_rows = np.flatnonzero(steps > GAP_FACTOR * step)
    gaps = tuple(Gap(int(i), float(time[i]), float(steps[i])) for i in gap_rows)
    return Sampling(
        len(recording), float(time.max() - time.min()), _sample_time(steps), jitter, gaps if step else (),
        _rows(steps == 0), _rows(steps < 0),
    )  # fmt: skip


def _sample_time(steps: Array) -> float:
    """The median step that is not zero, of rounded time stamps the mean step outside gaps; 0 if time stands still."""
    if not (steps > 0).any():
        return 0.0
    median = float(np.median(steps[steps > 0]))
    if (steps > 0).all() or (steps < 0).any():
        return median
    return float(steps[steps <= GAP_FACTOR * median].mean())


def _rows(irregular_steps: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(i) + 1 for i in np.flatnonzero(irregular_steps))


def count_rows(seconds: float, time: Array | None, min_rows: int) -> int:
    """The number of rows in a time span, at most all; `min_rows` without time or if the rows are far apart."""
    if not seconds >= 0.0:
        raise ParameterError(f"a duration is {seconds} s; it must not be negative.")
    if time is None or len(time) < 2:
        return min_rows
    sample_time = _sample_time(np.diff(time))
    return max(min_rows, round(min(seconds / sample_time, len(time)))) if sample_time else min_rows
