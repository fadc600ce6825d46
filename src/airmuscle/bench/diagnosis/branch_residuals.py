"""Loops of the force that a static law does not describe: branches that the residuals follow, a
delay of the sensor.

A force that is read later by tau opens a loop whose width is 2 tau dF/dt, proportional to the
speed, and its maximum follows that of the pressure by tau; a pressure that is read later gives the
same with a negative tau. A low-pass filter opens the same loop as a delay, but rounds the maximum
and moves it less, by tau ln 2 if it is of first order. The loop of friction is independent of the
speed, and its maximum is that of the pressure. A delay or a filter is found where the loop and the
turning point give the same tau within a tolerance that holds both.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, Hint, HintedText
from ...recording import Recording
from ...recording.columns import QUANTITIES
from ..estimation import reading_deviations
from ..inspection import (
    branch_directions,
    branch_name,
    find_branches,
    remembered,
    rounding,
    running_median,
)

MIN_LOOP_ROWS = 12
MIN_LOOPS = 2
"""Minimum number of rows of a branch, and of turning points that must agree (chosen)."""
LOOP_BINS = 8
"""Intervals of pressure in which the width of a loop is measured (chosen)."""
AGREEMENT = 0.35
"""Relative difference of the delays of the loop and of the turning point that still agree
(chosen).
"""
MIN_SAMPLES = 2.0
"""Minimum delay, in sample times (chosen)."""
DWELL_ROWS = 4
"""Rows at the highest pressure from which it dwells there, so that the turning point is not sharp
(chosen).
"""


ROUNDED = 1.5
MIN_TOP_ROWS = 4
"""Rows at the maximum of the later quantity, over those of the earlier, from which a filter has
rounded it, and minimum number of the latter by which this can be told (chosen)."""
TOP = 0.02
"""Distance from the maximum of the rows at it, as a fraction of the range (chosen)."""
DELAY = "a delay between the sensors"
FILTER = "a low-pass filter"
EITHER = "a delay or a low-pass filter"


class SensorDelay(NamedTuple):
    """The delay of the force after the pressure [s], from the loops and from their turning points;
    negative where the pressure is later."""

    loop: float
    turning_point: float
    width: float
    """Median width of the loops [N]."""
    loops: int
    rows_at_top: float = 0.0
    """Rows at the maximum of the earlier quantity."""
    rounding: float = 1.0
    """Rows at the maximum of the later quantity over these."""

    @property
    def kind(self) -> str:
        """A delay, a low-pass filter, which rounds the maximum, or either where the rows are too
        few to tell.
        """
        if self.rows_at_top < MIN_TOP_ROWS:
            return EITHER
        return FILTER if self.rounding > ROUNDED else DELAY


def find_delay(recordings: Sequence[Recording]) -> SensorDelay | None:
    """The delay that explains the loops of isometric ramps; None where they show none."""
    turns = [turn for run in recordings for turn in _turns(run)]
    if len(turns) < MIN_LOOPS:
        return None
    loop, peak, width, sample_time, *tops = np.median(np.array(turns), axis=0).tolist()
    least = min(abs(loop), np.sign(loop) * peak)
    if least < MIN_SAMPLES * sample_time or abs(peak - loop) > AGREEMENT * abs(loop) + sample_time:
        return None
    earlier, later = tops if loop > 0.0 else reversed(tops)
    return SensorDelay(loop, peak, width, len(turns), earlier, later / earlier)


def delay_notes(delay: SensorDelay | None) -> list[str]:
    """The remark that loops are those of a delay or of a filter; empty without one."""
    if delay is None:
        return []
    later, earlier = ("force", "pressure") if delay.loop > 0 else ("pressure", "force")
    times = [f"{1e3 * abs(value):.3g} ms" for value in (delay.loop, delay.turning_point)]
    loops = f"The loops of the ramps, {abs(delay.width):.3g} N wide, are those of"
    slower = "ramp the pressure more slowly."
    if delay.kind == FILTER:
        return [
            f"{loops} a low-pass filter of the {later}: it follows the {earlier} by {times[0]} on a"
            f" ramp, its maxima are {delay.rounding:.2g} times as long and {times[1]} later"
            f" ({delay.loops} turning points). A delay rounds no maximum, and friction has no delay"
            f" there. Do not take them for friction: turn the filter off, or {slower} A shift in"
            " time does not undo it."
        ]
    remedy = f"shift the {later} by this time" if delay.kind == DELAY else "sample faster to tell"
    return [
        f"{loops} {delay.kind}: the {later} follows the {earlier} by {times[0]}, and so do its"
        f" maxima ({times[1]}, {delay.loops} turning points), while friction has no delay there."
        f" Do not take them for friction: {remedy}, or {slower}"
    ]


def _turns(recording: Recording) -> Iterator[tuple[float, ...]]:
    """At each maximum of the pressure of a recording with time: delays [s] of the loop of its
    branches and of its turning point, width of the loop [N], sample time [s], and the rows at the
    maximum of pressure and force; none where both dwell there or the force is flat.
    """
    if (
        any(name not in recording for name in ("time", "pressure", "force"))
        or len(recording) < 2 * MIN_LOOP_ROWS
    ):
        return
    if not np.isfinite(recording["time"] + recording["pressure"] + recording["force"]).all():
        return
    branches = [branch for branch in find_branches(recording) if branch.column == "pressure"]
    for up, down in itertools.pairwise(branches):
        if (
            not up.direction > 0 > down.direction
            or min(len(up.interval), len(down.interval)) < MIN_LOOP_ROWS
        ):
            continue
        rows = slice(up.interval.start, down.interval.stop)
        time = recording["time"][rows]
        pressure = recording["pressure"][rows]
        force = running_median(recording["force"][rows], 3)
        top = int(np.argmax(_is_greatest(pressure)))
        step = float(np.median(np.diff(time)))
        # A filter rounds one of them, a dwell both.
        dwell = min(_rows_at_top(pressure), _rows_at_top(force))
        if step <= 0 or dwell > DWELL_ROWS + 0.06 * time.size:
            continue
        loop = _loop_delay(time, pressure, force, top)
        if loop is not None:
            maxima = [np.mean(time[_is_greatest(values)]) for values in (pressure, force)]
            peak = float(maxima[1] - maxima[0])
            yield loop[0], peak, loop[1], step, _rows_at_top(pressure), _rows_at_top(force)


def _is_greatest(values: Array) -> npt.NDArray[np.bool_]:
    """The rows (N,) whose reading is the maximum, which a ramp may read twice."""
    return np.asarray(values >= np.max(values) - rounding("", values))


def _rows_at_top(values: Array) -> int:
    """The number of rows at the maximum of a ramp."""
    return int(np.count_nonzero(values > np.max(values) - TOP * float(np.ptp(values))))


def _loop_delay(time: Array, pressure: Array, force: Array, top: int) -> tuple[float, float] | None:
    """The delay [s] that closes the loop, and its width [N], as medians over intervals of
    pressure.
    """
    low = float(np.min(pressure))
    high = float(pressure[top])
    edges = np.linspace(low + 0.2 * (high - low), high - 0.1 * (high - low), LOOP_BINS + 1)
    delays = []
    for a, b in itertools.pairwise(edges):
        sides = [
            _line(time, pressure, force, part, a, b) for part in (slice(0, top), slice(top, None))
        ]
        if sides[0] is None or sides[1] is None:
            continue
        width = sides[1][0] - sides[0][0]
        change = abs(sides[0][1]) + abs(sides[1][1])
        if change > 0:
            delays.append((width / change, width))
    return tuple(np.median(delays, axis=0).tolist()) if len(delays) >= LOOP_BINS // 2 else None


def _line(
    time: Array, pressure: Array, force: Array, part: slice, low: float, high: float
) -> Array | None:
    """The force [N] in the middle of an interval of pressure on one branch, and its rate [N/s];
    None with few rows, or with a single reading of the pressure.
    """
    inside = (pressure[part] >= low) & (pressure[part] <= high)
    if np.count_nonzero(inside) < 3:
        return None
    p = pressure[part][inside]
    if np.ptp(p) <= rounding("pressure", pressure):
        return None
    f = force[part][inside]
    t = time[part][inside]
    level = np.polyfit(p - 0.5 * (low + high), f, 1)
    rate = np.polyfit(t - t[0], p, 1)[0]
    return np.array([level[1], level[0] * rate])


MIN_BRANCH_ROWS = 5
"""Minimum number of rows of a branch (chosen); the jump between two levels of a map is no
branch.
"""
BINS = 12
MIN_BINS = 3
"""Intervals of the driven quantity in each recording within which the two branches are compared,
and minimum number of those with rows of both (chosen)."""
MIN_STANDARD_ERRORS = 3.0
"""Standard errors above which the mean difference is not random (chosen)."""


_BranchBins = tuple[npt.NDArray[np.bool_], Array, npt.NDArray[np.intp], str]
"""Mask of the rows with a pressure; of these the direction (1 inflating or contracting, -1
deflating or extending) and the interval of the driven quantity, whose column is named."""


def branch_distance(runs: Sequence[Recording], residuals: Sequence[Array], quantity: str) -> float:
    """The distance [SI] of the two branches that the residuals of a fit follow; 0 if they follow
    none.

    residuals  (model - measured) of each row of each recording [SI], NaN for rows that are not
               measured

    The medians of both branches are compared at equal driven quantity, so that neither an error of
    the law that both share nor an outlier counts. Their average difference must exceed three
    standard errors and the standard deviation of the sensor of the fitted `quantity`.
    """
    differences: list[
        float
    ] = []  # median residual of inflating or contracting rows minus that of the others
    for run, of_run in zip(runs, residuals, strict=True):
        known, direction, bins, _ = _branch_bins(run)
        if not direction.any():
            continue
        values = of_run[known]
        used = np.isfinite(values) & (direction != 0)
        cell = 2 * bins[used] + (direction[used] > 0)
        counts = np.bincount(cell, minlength=2 * BINS)
        parts = np.split(values[used][np.argsort(cell, kind="stable")], np.cumsum(counts))
        pairs = zip(parts[1 : 2 * BINS : 2], parts[0 : 2 * BINS : 2], strict=True)
        differences += [
            float(np.median(up) - np.median(down)) for up, down in pairs if up.size and down.size
        ]
    if len(differences) < MIN_BINS:
        return 0.0
    mean = abs(float(np.mean(differences)))
    standard_error = float(np.std(differences, ddof=1) / np.sqrt(len(differences)))
    random = (
        mean <= MIN_STANDARD_ERRORS * standard_error
        or mean <= reading_deviations(runs, quantity)[0]
    )
    return 0.0 if random else mean


def row_directions(run: Recording) -> Array:
    """The direction (N,) of the motion of each row of a recording: 1 inflating or contracting, -1
    back, 0 where it is not known.
    """
    known, direction, *_ = _branch_bins(run)
    signs = np.zeros(len(run))
    if direction.size:
        signs[known] = direction
    return signs


_BRANCH_CAUSES = (
    " Friction keeps this distance at any speed; that of a lag or filter of a sensor grows with the"
    " speed, that of creep with the duration. Repeat a run at another speed before it is taken for"
    " friction.",
    Hint("To identify the friction", function="bench.fit_hysteresis"),
)
"""What tells the causes of two branches apart; not where they are no friction."""


def branch_notes(
    runs: Sequence[Recording],
    distance: float,
    quantity: str,
    *,
    causes: str = "",
    is_friction: bool = True,
) -> list[str]:
    """The remark that the residuals of a fit follow two branches at a distance [SI]; empty without
    a distance.

    causes       a sentence with the causes of the residuals, if they are known
    is_friction  whether they may be friction
    """
    if not distance:
        return []
    unit = QUANTITIES[quantity].unit
    text = f"{100 * distance:.3g} %" if unit == "1" else f"{distance:.3g} {unit}"
    columns = {column for *_, column in map(_branch_bins, runs) if column}
    names = [
        " and ".join(branch_name(column, d) for d in (1, -1))
        for column in sorted(columns, reverse=True)
    ]
    return [
        HintedText(
            f"The residuals follow two branches, {text} apart on average"
            f" ({'; '.join(dict.fromkeys(names))}). {causes}".rstrip(),
            *(_BRANCH_CAUSES if is_friction else []),
        )
    ]


@remembered
def _branch_bins(run: Recording) -> _BranchBins:
    """The branches of a recording: a comparison asks for them for every law."""
    known = np.isfinite(run["pressure"])
    complete = run if known.all() else run.rows(known)
    branches = tuple(
        branch for branch in find_branches(complete) if len(branch.interval) >= MIN_BRANCH_ROWS
    )
    directions = {branch.direction for branch in branches}
    if len(directions) < 2:
        return known, np.zeros(0), np.zeros(0, dtype=np.intp), ""
    column = branches[0].column
    driven = complete[column]
    edges = np.linspace(driven.min(), driven.max(), BINS + 1)[1:-1]
    return known, branch_directions(complete, branches), np.digitize(driven, edges), column
