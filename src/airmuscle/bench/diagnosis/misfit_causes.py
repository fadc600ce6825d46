"""Causes of a misfit, ranked by the share of the squared residuals that each explains: the form of
the law, single runs, the direction of the motion, and the steps of the pressure.

The shares are those of successive regressions: what a smooth surface over pressure and contraction
takes up is the form of the law; of the rest, what an offset and a gain of each run take up is a
difference between runs; and what then follows the direction is friction, or a lag of a sensor.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording import Recording
from ..inspection import estimate_resolution
from .branch_residuals import row_directions

SURFACE_DEGREE = 4
"""Total degree of the surface that takes up an error of the form of the law (chosen)."""
MIN_SHARE = 0.1
"""Minimum share of the squared residuals of a cause that is named (chosen)."""
MIN_ROWS = 30
"""Minimum number of rows in which causes are looked for (chosen)."""
HELD = 0.005
"""Range of the contraction at a held length (chosen)."""
MIN_READINGS = 4
MIN_ROWS_OF_READING = 3
EVEN = 0.1
"""Number of readings of a ramp, rows of each, and relative difference of the steps between them,
from which they are those of a coarse sensor (chosen)."""
FORM = "the form of the law"
RUNS = "offsets and gains of single runs (another muscle, a temperature, a zero)"
RUNS_REMEDY = (
    "No law follows such runs: check whether the muscle, its temperature or a zero has changed"
    " between them."
)
DIRECTION = "the direction of the motion (friction, or a lag of a sensor)"
STEPS = "the steps of the pressure readings"


class MisfitCause(NamedTuple):
    """A cause and its share of the squared residuals, from 0 to 1."""

    name: str
    share: float


def misfit_causes(
    recordings: Sequence[Recording], residuals: Sequence[Array]
) -> tuple[MisfitCause, ...]:
    """The causes of the residuals (model - measured) [N] of a static law, the greatest share first.

    residuals  of the rows of each recording, NaN for rows that are not measured
    """
    rows = _Rows.of(recordings, residuals)
    total = float(rows.residual @ rows.residual)
    if rows.residual.size < MIN_ROWS or not total > 0.0:
        return ()
    causes = []
    rest = rows.residual
    for name, columns in (
        (FORM, _surface(rows)),
        (RUNS, _by_run(rows)),
        (DIRECTION, rows.direction[:, None]),
    ):
        before = float(rest @ rest)
        rest = rest - columns @ np.linalg.lstsq(columns, rest, rcond=1e-9)[0]
        causes.append(MisfitCause(name, (before - float(rest @ rest)) / total))
    steps = min(rows.step_variance * rows.residual.size / total, float(rest @ rest) / total)
    causes.append(MisfitCause(STEPS, steps))
    named = [cause for cause in causes if cause.share >= MIN_SHARE]
    return tuple(sorted(named, key=lambda cause: -cause.share))


def causes_text(causes: Sequence[MisfitCause]) -> str:
    """The causes as a sentence; that none is known without any."""
    if not causes:
        return "No form of the law, run, direction or step of the readings explains it."
    parts = [f"{100 * cause.share:.2g} % by {cause.name}" for cause in causes]
    remedy = f" {RUNS_REMEDY}" if causes[0].name == RUNS else ""
    return f"Of the squared residuals are explained: {', '.join(parts)}.{remedy}"


class _Rows(NamedTuple):
    """The measured rows of all recordings: residual [N], scaled pressure and contraction, force
    [N], direction and number of the run, shape (N,) each; and the variance of the force [N^2] that
    follows from the steps of the pressure."""

    residual: Array
    pressure: Array
    contraction: Array
    force: Array
    direction: Array
    run: npt.NDArray[np.intp]
    step_variance: float

    @classmethod
    def of(cls, recordings: Sequence[Recording], residuals: Sequence[Array]) -> "_Rows":
        residual = np.concatenate([np.zeros(0), *residuals])
        direction = np.concatenate([np.zeros(0), *map(row_directions, recordings)])
        run = np.repeat(np.arange(len(recordings)), [len(each) for each in recordings])
        columns = [
            np.concatenate([np.zeros(0), *(each[name] for each in recordings)])
            for name in ("pressure", "contraction", "force")
        ]
        known = np.isfinite(residual + sum(columns))
        pressure, contraction, force = (column[known] for column in columns)
        step = max(map(_pressure_step, recordings), default=0.0)
        slope = _pressure_slope(pressure, contraction, force)
        return cls(
            residual[known],
            _scaled(pressure),
            _scaled(contraction),
            force,
            direction[known],
            run[known],
            float(np.mean((slope * step) ** 2)) / 12.0 if pressure.size else 0.0,
        )


def _pressure_step(recording: Recording) -> float:
    """The step of the readings of the pressure of a run [Pa]; also where it is so great that there
    are few readings, if a ramp at a held length goes through them.
    """
    pressure = recording["pressure"][np.isfinite(recording["pressure"])]
    step = estimate_resolution(pressure)
    contraction = recording["contraction"]
    is_held = contraction.size > 0 and np.nanmax(contraction) - np.nanmin(contraction) < HELD
    if step > 0.0 or "time" not in recording or not is_held:
        return step
    readings = np.unique(pressure)
    few = MIN_READINGS <= readings.size <= pressure.size / MIN_ROWS_OF_READING
    gaps = np.diff(readings)
    is_even = few and float(np.ptp(gaps)) <= EVEN * float(np.median(gaps))
    return float(np.median(gaps)) if is_even else 0.0


def _scaled(values: Array) -> Array:
    """The values on a scale from -1 to 1."""
    if not values.size or not np.ptp(values) > 0.0:
        return np.zeros(values.size)
    return np.asarray(2.0 * (values - np.min(values)) / np.ptp(values) - 1.0)


def _pressure_slope(pressure: Array, contraction: Array, force: Array) -> Array:
    """The slope of the force over the pressure [N/Pa] of each row, of a bilinear surface."""
    if pressure.size < MIN_ROWS:
        return np.zeros(pressure.size)
    scale = max(float(np.max(np.abs(pressure))), 1e-300)
    ratio = pressure / scale
    columns = np.stack([np.ones(ratio.size), ratio, contraction, ratio * contraction], axis=1)
    values = np.linalg.lstsq(columns, force, rcond=1e-9)[0]
    return np.asarray((values[1] + values[3] * contraction) / scale)


def _surface(rows: _Rows) -> Array:
    """The columns of a polynomial surface over pressure and contraction."""
    powers = [(i, j) for i in range(SURFACE_DEGREE + 1) for j in range(SURFACE_DEGREE + 1 - i)]
    return np.stack([rows.pressure**i * rows.contraction**j for i, j in powers], axis=1)


def _by_run(rows: _Rows) -> Array:
    """The columns of an offset and of a gain of the force in each run."""
    member = rows.run[:, None] == np.unique(rows.run)
    return np.hstack([member, member * rows.force[:, None]]).astype(float)
