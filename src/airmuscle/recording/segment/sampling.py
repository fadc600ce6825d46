"""When the rows of a recording were taken: rate, jitter, gaps, and stamps that repeat or run backwards."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ..recording import Recording

GAP_FACTOR = 5.0
"""A step in time is a gap where it is this many times the usual one (chosen)."""


@dataclasses.dataclass(frozen=True)
class Gap:
    """No rows were taken between row `row` and the next, from `start` [s] for `length` [s]."""

    row: int
    start: float
    length: float


@dataclasses.dataclass(frozen=True)
class Sampling:
    """Rows, seconds from first to last, usual step [s], jitter as a part of it, and where time goes wrong.

    Rows are counted from 0; `repeats` and `backward` are rows whose time equals, or lies before, the one before.
    """

    rows: int
    duration: float
    step: float
    jitter: float
    gaps: tuple[Gap, ...] = ()
    repeats: tuple[int, ...] = ()
    backward: tuple[int, ...] = ()

    @property
    def rate(self) -> float:
        """Usual rows per second."""
        return 1.0 / self.step if self.step > 0 else float("nan")


def analyse_sampling(recording: Recording) -> Sampling | None:
    """The sampling of a recording; None where it has no time, or fewer than two rows."""
    if "time" not in recording or len(recording) < 2:
        return None
    time = recording["time"]
    steps = np.diff(time)
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if forward.size else 0.0
    spread = 1.4826 * float(np.median(np.abs(forward - usual))) / usual if usual else 0.0
    gaps = tuple(Gap(int(i), float(time[i]), float(steps[i])) for i in np.flatnonzero(steps > GAP_FACTOR * usual))
    return Sampling(
        len(recording), float(time.max() - time.min()), usual, spread, gaps if usual else (),
        _rows(steps == 0), _rows(steps < 0),
    )  # fmt: skip


def _rows(wrong: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(i) + 1 for i in np.flatnonzero(wrong))


def count_rows(seconds: float, time: Array | None, least: int) -> int:
    """How many rows a span of time holds, `least` where there is no time or the rows are far apart."""
    if time is None or len(time) < 2:
        return least
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    return max(least, round(seconds / usual)) if usual else least
