"""Rows of the recordings of a bench for its checks: joined columns, robust limits, lines of force
over pressure.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording.recording import Recording
from ..inspection import (
    EDGE,
    ROUNDING,
    distinct_readings,
    estimate_sensors,
    merged_readings,
    remembered,
)

MIN_FORCE = 0.05
"""Minimum force of a row that surely pulls, as a fraction of the maximum force (chosen)."""
NO_PRESSURE = 0.01
"""Pressure that counts as none, as a fraction of the highest (chosen)."""
MAX_ELONGATION = 0.005
"""Elongation and contraction that count as the resting length (chosen); a stretched muscle pulls
without pressure.
"""
MIN_ROWS = 6
"""Minimum number of rows of a level (chosen)."""
CONSTANT_PRESSURE = 0.06
"""Range of the pressure of an isobar, as a fraction of its pressure (chosen)."""
STEP = 0.01
MIN_STEPS = 3
FLAT = 0.1
"""Steps of the contraction in which the force of an isobar is averaged, the minimum number of
successive ones without a change of the force, and the change that counts as none, as a fraction of
the mean one of a step (chosen)."""
MIN_LEVELS = 3
MIN_RANGE = 0.05
"""Minimum number of contractions whose lines of force over pressure show a zero, and their minimum
range (chosen).
"""
REST_DEGREE = 3
MIN_REST_LINES = 6
MAX_REST_DISTANCE = 0.05
"""Degree in the contraction by which such lines are extrapolated to zero contraction, the minimum
number of lines, and the maximum contraction of the first (chosen)."""
LEVELS = 8
"""Number of intervals of the contraction, with equal numbers of rows, in which force is taken as
linear in pressure.
"""


def recordings_with(recordings: Sequence[Recording], *names: str) -> list[Recording]:
    """The recordings that have all named columns, with a reading in each."""
    return [
        run
        for run in recordings
        if all(name in run and np.isfinite(run[name]).any() for name in names)
    ]


def limits(values: Array) -> tuple[float, float]:
    """The 1 % and the 99 % quantile, so that a glitch is not judged."""
    low, high = np.nanquantile(values, [0.01, 0.99])
    return float(low), float(high)


def files_of(recordings: Sequence[Recording]) -> str:
    """The names of the files of recordings, as `file_list`."""
    return file_list([recording.origin for recording in recordings])


def file_list(origins: Sequence[str], most: int = 3) -> str:
    """Names of files as text, the first ones and the number of the others."""
    names = list(dict.fromkeys(origins))
    rest = len(names) - most
    return ", ".join(names) if rest <= 1 else f"{', '.join(names[:most])} and {rest} more"


class BenchRows(NamedTuple):
    """Pressure [Pa], contraction [1] and force [N] of all complete rows of a bench; shape (N,)
    each.
    """

    pressure: Array
    contraction: Array
    force: Array

    def at(self, rows: npt.NDArray[np.bool_]) -> "BenchRows":
        """The rows of a mask (N,)."""
        return BenchRows(*(column[rows] for column in self))

    @property
    def greatest(self) -> float:
        """The maximum force [N] without glitches; 0 without rows."""
        return limits(self.force)[1] if self.force.size else 0.0

    @property
    def shortened(self) -> "BenchRows":
        """The rows at the resting length and shorter."""
        return self.at(self.contraction > -MAX_ELONGATION)

    @property
    def pulling(self) -> "BenchRows":
        """The rows whose force is above `MIN_FORCE`."""
        return self.at(self.force > MIN_FORCE * self.greatest)

    @property
    def slack(self) -> "BenchRows":
        """The rows at zero pressure and shortened length, where a muscle is slack."""
        without = np.abs(self.pressure) < NO_PRESSURE * np.max(self.pressure, initial=0.0)
        return self.at(without & (self.contraction > MAX_ELONGATION))


SINGULAR = 1e-9
"""Relative singular value below which a line is not determined (chosen)."""


@remembered
def bench_rows(recordings: Sequence[Recording]) -> BenchRows:
    """The complete rows of the recordings that have all three quantities."""
    measured = recordings_with(recordings, *BenchRows._fields)
    columns = [np.concatenate([[], *(run[name] for run in measured)]) for name in BenchRows._fields]
    complete = np.isfinite(np.sum(columns, axis=0))
    if complete.size:  # at its upper limit, the force sensor states a bound only
        sensor = estimate_sensors(
            [Recording({"force": recording["force"]}, recording.origin) for recording in measured]
        )["force"]
        complete &= columns[2] < sensor.upper_limit - sensor.tolerance
    return BenchRows(*(column[complete] for column in columns))


def slack_plateaus(recordings: Sequence[Recording]) -> BenchRows:
    """The rows of isobars at which the muscle is slack: the force does not change with the
    contraction, up to the shortest length. Drift and friction of a run, which returns, are in the
    mean of each step of the contraction.
    """
    plateaus = []
    for recording in recordings_with(recordings, *BenchRows._fields):
        run = bench_rows([recording])
        if run.force.size < MIN_ROWS or np.ptp(run.pressure) > CONSTANT_PRESSURE * np.max(
            run.pressure
        ):
            continue
        step = ((np.max(run.contraction) - run.contraction) / STEP + EDGE).astype(int)
        counts = np.bincount(step)
        means = np.bincount(step, run.force) / np.maximum(counts, 1)
        change = FLAT * np.subtract(*limits(run.force)[::-1]) / max(counts.size - 1, 1)
        flat = np.count_nonzero(
            np.logical_and.accumulate((counts > 0) & (np.abs(means - means[0]) < change))
        )
        plateaus += [run.at(step < flat)] if flat >= MIN_STEPS else []
    return BenchRows(
        *(
            np.concatenate([np.zeros(0), *(getattr(e, n) for e in plateaus)])
            for n in BenchRows._fields
        )
    )


class PressureLine(NamedTuple):
    """The straight line of the force over the pressure at one contraction, of the rows that
    pull.
    """

    contraction: float
    intercept: float
    """Force at zero pressure [N], extrapolated."""
    slope: float
    """Slope [N/Pa]."""
    error: float
    """Standard error of the intercept [N], of independent rows."""

    @property
    def zero_force_pressure(self) -> float:
        """The pressure [Pa] at which the line gives no force."""
        return -self.intercept / self.slope


class RestLine(NamedTuple):
    """The line of force over pressure at zero contraction, where a wall of rubber has no force: the
    lines at the measured contractions, extrapolated. Beside zero contraction the wall moves the
    intercept, so that only here it shows the zeros of the sensors."""

    intercept: float
    """Force at zero pressure [N]."""
    slope: float
    """Slope [N/Pa]."""
    error: float
    """Standard error of the intercept [N]."""

    @property
    def zero_force_pressure(self) -> float:
        """The pressure [Pa] at which the line gives no force."""
        return -self.intercept / self.slope


def rest_line(lines: Sequence[PressureLine]) -> RestLine | None:
    """The line at zero contraction, by polynomials of intercept and slope over the contraction;
    None where the lines are too few, or too far from it.
    """
    if len(lines) < MIN_REST_LINES or lines[0].contraction > MAX_REST_DISTANCE:
        return None
    contraction = np.array([line.contraction for line in lines])
    matrix = np.vander(contraction, REST_DEGREE + 1, increasing=True)
    observed = np.array([[line.intercept, line.slope] for line in lines])
    values = np.linalg.lstsq(matrix, observed, rcond=None)[0]
    rest = observed[:, 0] - matrix @ values[:, 0]
    scatter = float(rest @ rest) / (contraction.size - matrix.shape[1])
    errors = np.array([line.error for line in lines])
    inverse = np.linalg.pinv(matrix)
    error = np.sqrt(np.sum(inverse[0] ** 2 * np.maximum(errors**2, scatter)))
    return RestLine(float(values[0, 0]), float(values[0, 1]), float(error))


def pressure_lines(rows: BenchRows) -> list[PressureLine]:
    """The lines of force over pressure at levels of the contraction; those with too few rows or
    pressures are omitted.

    Empty unless there are `MIN_LEVELS` of them over a range of `MIN_RANGE`. Within a level the
    force is taken as bilinear in pressure and contraction, at the middle of the level.
    """
    pull = rows.shortened.pulling
    if pull.force.size < MIN_ROWS:
        return []
    contraction = merged_readings(pull.contraction)  # a level is not divided by rounding
    edges = distinct_readings(np.quantile(contraction, np.linspace(0.0, 1.0, LEVELS + 1)))
    above = np.searchsorted(edges * (1.0 - ROUNDING * np.sign(edges)), contraction, side="right")
    level = np.clip(above, 1, max(edges.size - 1, 1))
    lines = []
    for i in range(1, max(edges.size, 2)):
        part = pull.at(level == i)
        if part.force.size < MIN_ROWS or np.ptp(part.pressure) < 0.5 * np.max(part.pressure):
            continue
        middle = float(np.median(part.contraction))
        offset = part.contraction - middle
        columns = [np.ones(offset.size), part.pressure]
        if np.ptp(offset) > 1e-3:
            columns += [offset, part.pressure * offset]
        matrix = np.column_stack(columns)
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        values, _, rank, _ = np.linalg.lstsq(matrix / scale, part.force, rcond=SINGULAR)
        if rank < matrix.shape[1] or not values[1] > 0:
            continue
        residual = part.force - matrix @ (values / scale)
        variance = float(residual @ residual) / max(offset.size - rank, 1)
        error = float(
            np.sqrt(variance * np.linalg.inv((matrix / scale).T @ (matrix / scale))[0, 0])
        ) / float(scale[0])
        lines.append(
            PressureLine(middle, float(values[0] / scale[0]), float(values[1] / scale[1]), error)
        )
    return (
        lines
        if len(lines) >= MIN_LEVELS and lines[-1].contraction - lines[0].contraction >= MIN_RANGE
        else []
    )
