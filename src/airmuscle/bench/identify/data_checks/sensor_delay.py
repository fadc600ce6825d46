"""Delay between the sensors of pressure and force, which opens a loop that looks like friction.

A force that is read later by tau opens a loop whose width is 2 tau dF/dt, proportional to the speed, and its maximum
follows that of the pressure by tau. The loop of friction is independent of the speed, and its maximum is that of the
pressure. A delay is found where the loop and the turning point give the same tau.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....core.arrays import Array
from ....recording import Recording
from ...segment import Branch, find_branches
from ...segment.interval import running_median

MIN_BRANCH_ROWS = 12
"""Minimum number of rows of a branch (chosen)."""
BINS = 8
"""Intervals of pressure in which the width of a loop is measured (chosen)."""
MIN_LOOPS = 2
"""Minimum number of turning points that must agree (chosen)."""
AGREEMENT = 0.35
"""Relative difference of the delays of the loop and of the turning point that still agree (chosen)."""
MIN_SAMPLES = 2.0
"""Minimum delay, in sample times (chosen)."""
DWELL_ROWS = 4
"""Rows at the highest pressure from which it dwells there, so that the turning point is not sharp (chosen)."""


@dataclasses.dataclass(frozen=True)
class SensorDelay:
    """The delay of the force after the pressure [s], from the loops and from their turning points."""

    loop: float
    turning_point: float
    width: float
    """Median width of the loops [N]."""
    loops: int


class _Turn(NamedTuple):
    loop: float
    turning_point: float
    width: float
    sample_time: float


def find_delay(recordings: Sequence[Recording]) -> SensorDelay | None:
    """The delay that explains the loops of isometric ramps; None where they show none."""
    turns = [turn for run in recordings for turn in _turns(run)]
    if len(turns) < MIN_LOOPS:
        return None
    loop, peak, width, sample_time = (float(v) for v in np.median(np.array(turns), axis=0))
    if min(loop, peak) < MIN_SAMPLES * sample_time or abs(peak - loop) > AGREEMENT * loop + sample_time:
        return None
    return SensorDelay(loop, peak, width, len(turns))


def delay_notes(delay: SensorDelay | None) -> list[str]:
    """The remark that loops are those of a delay; empty without one."""
    if delay is None:
        return []
    return [
        f"The loops of the ramps, {delay.width:.3g} N wide, are those of a delay between the sensors: the force "
        f"follows the pressure by {1e3 * delay.loop:.3g} ms, and so do its maxima ({1e3 * delay.turning_point:.3g} ms, "
        f"{delay.loops} turning points), while friction has no delay there. Do not take them for friction: shift the "
        "force by this time, or ramp the pressure more slowly."
    ]


def _turns(recording: Recording) -> list[_Turn]:
    """The delays at each maximum of the pressure of a recording with time."""
    if any(name not in recording for name in ("time", "pressure", "force")) or len(recording) < 2 * MIN_BRANCH_ROWS:
        return []
    if not np.isfinite(recording["pressure"] + recording["force"]).all():
        return []
    branches = [b for b in find_branches(recording) if b.column == "pressure"]
    pairs = [(a, b) for a, b in itertools.pairwise(branches) if a.direction > 0 > b.direction]
    return [turn for a, b in pairs if (turn := _turn(recording, a, b)) is not None]


def _turn(recording: Recording, up: Branch, down: Branch) -> _Turn | None:
    """The delays of the loop of two branches; None where the pressure dwells at its maximum or the force is flat."""
    if min(len(up.interval), len(down.interval)) < MIN_BRANCH_ROWS:
        return None
    rows = slice(up.interval.start, down.interval.stop)
    time, pressure = recording["time"][rows], recording["pressure"][rows]
    force = running_median(recording["force"][rows], 3)
    top, span = int(np.argmax(pressure)), float(np.ptp(pressure))
    step = float(np.median(np.diff(time)))
    dwell = int(np.count_nonzero(pressure > pressure[top] - 0.02 * span))
    if step <= 0 or dwell > DWELL_ROWS + 0.06 * time.size:
        return None
    loop = _loop_delay(time, pressure, force, top)
    if loop is None:
        return None
    return _Turn(loop[0], float(time[int(np.argmax(force))] - time[top]), loop[1], step)


def _loop_delay(time: Array, pressure: Array, force: Array, top: int) -> tuple[float, float] | None:
    """The delay [s] that closes the loop, and its width [N], as medians over intervals of pressure."""
    low, high = float(np.min(pressure)), float(pressure[top])
    edges = np.linspace(low + 0.2 * (high - low), high - 0.1 * (high - low), BINS + 1)
    delays, widths = [], []
    for a, b in itertools.pairwise(edges):
        sides = [_line(time, pressure, force, part, a, b) for part in (slice(0, top), slice(top, None))]
        if sides[0] is None or sides[1] is None:
            continue
        width, change = sides[1][0] - sides[0][0], abs(sides[0][1]) + abs(sides[1][1])
        if change > 0:
            delays.append(width / change)
            widths.append(width)
    return (float(np.median(delays)), float(np.median(widths))) if len(delays) >= BINS // 2 else None


def _line(time: Array, pressure: Array, force: Array, part: slice, low: float, high: float) -> Array | None:
    """The force [N] in the middle of an interval of pressure on one branch, and its rate [N/s]; None with few rows."""
    inside = (pressure[part] >= low) & (pressure[part] <= high)
    if np.count_nonzero(inside) < 3:
        return None
    p, f, t = pressure[part][inside], force[part][inside], time[part][inside]
    level = np.polyfit(p - 0.5 * (low + high), f, 1)
    rate = np.polyfit(t - t[0], p, 1)[0]
    return np.array([level[1], level[0] * rate])
