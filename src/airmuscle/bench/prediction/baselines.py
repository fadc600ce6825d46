"""Baselines that a prediction must beat, persistence and a linear ARX model, and the skill of a
model against them.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...core import Array, ShortRepr

DEPTH = 4
RIDGE = 1e-6
"""Rows of outputs and inputs that the ARX model sees, and its regularisation (chosen)."""
GRID_ROWS = 200
"""Maximum number of rows of the longest record in a baseline, which has one sample time for all
records (chosen).
"""
LIMIT_MARGIN = 10.0
"""Distance of the limits of a free run from the measured values, in ranges of these (chosen)."""
PERSISTENCE = "persistence"
ARX = f"ARX of depth {DEPTH}"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LinearArx(ShortRepr):
    """Linear ARX model of the change of J outputs, from DEPTH rows of all outputs and K inputs and
    the inputs of the next row; the outputs of a free run are limited to `low` and `high` (J,), so
    that an unstable one stays finite.
    """

    mean: Array
    spread: Array
    coefficients: Array
    low: Array | float
    high: Array | float

    def free_run(self, past: Array, inputs: Array) -> Array:
        """Outputs (N, R, J) after `past` (N, DEPTH, J) by `inputs` (N, DEPTH + R, K), the first
        DEPTH at these rows.
        """
        outputs = past.copy()
        for row in range(DEPTH - 1, inputs.shape[1] - 1):
            first = row - DEPTH + 1
            seen = outputs[:, first : row + 1].reshape(len(outputs), -1)
            driven = inputs[:, first : row + 2].reshape(len(outputs), -1)
            regressors = np.concatenate([seen, driven], axis=1)
            scaled = (regressors - self.mean) / self.spread
            following = outputs[:, -1] + scaled @ self.coefficients[:-1] + self.coefficients[-1]
            limited = np.clip(following, self.low, self.high)
            outputs = np.concatenate([outputs, limited[:, None]], axis=1)
        return outputs[:, DEPTH:]


def fit_arx(
    runs: Sequence[tuple[Array, Array]], low: Array | float, high: Array | float
) -> LinearArx:
    """Least squares of the change of the outputs in runs with outputs (R, J) and inputs (R, K), R >
    DEPTH + 1.
    """
    seen = []
    changes = []
    for outputs, inputs in runs:
        count = len(outputs) - DEPTH
        past = (
            sliding_window_view(outputs, DEPTH, axis=0)[:count]
            .transpose(0, 2, 1)
            .reshape(count, -1)
        )
        driven = (
            sliding_window_view(inputs, DEPTH + 1, axis=0).transpose(0, 2, 1).reshape(count, -1)
        )
        seen.append(np.concatenate([past, driven], axis=1))
        changes.append(outputs[DEPTH:] - outputs[DEPTH - 1 : -1])
    x = np.concatenate(seen)
    y = np.concatenate(changes)
    mean = x.mean(axis=0)
    spread = x.std(axis=0) + 1e-9
    design = np.column_stack([(x - mean) / spread, np.ones(len(x))])
    normal = design.T @ design + RIDGE * len(design) * np.eye(design.shape[1])
    return LinearArx(mean, spread, np.linalg.solve(normal, design.T @ y), low, high)


def skill(error: float, baselines: Mapping[str, float]) -> float | None:
    """1 - error/error of the best baseline; None without a baseline that errs."""
    best = min(baselines.values(), default=0.0)
    return 1.0 - error / best if best > 0.0 else None


class TimedRecord(NamedTuple):
    """Rising times (R,), measured outputs (R, J), inputs (R, K) that drive them, mask (R, J) of the
    compared rows.
    """

    time: Array
    outputs: Array
    inputs: Array
    compared: Array

    def on_grid(self, step: float) -> "TimedRecord":
        """The record at even times; missing values are interpolated."""
        time = self.time[0] + step * np.arange(
            int((self.time[-1] - self.time[0]) / step * (1 + 1e-9)) + 1
        )
        outputs, inputs = (
            _interpolated(time, self.time, part) for part in (self.outputs, self.inputs)
        )
        return TimedRecord(time, outputs, inputs, np.ones(outputs.shape, dtype=bool))


def _interpolated(at: Array, time: Array, columns: Array) -> Array:
    """Columns (R, K) at other times (N, K); 0 where a column has no value."""
    values = np.zeros((at.size, columns.shape[1]))
    for k, known in enumerate(np.isfinite(columns).T):
        if known.any():
            values[:, k] = np.interp(at, time[known], columns[known, k])
    return values


def baseline_errors(records: Sequence[TimedRecord]) -> list[dict[str, Array]]:
    """The rms errors (J,) of the free run of each baseline over the compared rows of each record,
    by name.

    Persistence keeps the first value. The ARX model is fitted to the other records with as many
    outputs and inputs, or, for a record without others, to each half of it, and runs through the
    rest; its first DEPTH rows are the measured ones. A record of fewer rows than two such fits need
    has persistence alone.
    """
    longest = max((float(np.ptp(record.time)) for record in records), default=0.0)
    sampled = max(
        (float(np.median(np.diff(record.time))) for record in records if record.time.size > 1),
        default=0.0,
    )
    grids = [record.on_grid(max(sampled, longest / GRID_ROWS)) for record in records]
    sizes = [(record.outputs.shape[1], record.inputs.shape[1]) for record in records]
    record_errors = []
    for i, record in enumerate(records):
        first = record.outputs[
            np.argmax(record.compared, axis=0), np.arange(record.outputs.shape[1])
        ]
        errors = {PERSISTENCE: _rms(record, np.broadcast_to(first, record.outputs.shape))}
        alike = [grid for k, grid in enumerate(grids) if k != i and sizes[k] == sizes[i]]
        training = [grid for grid in alike if len(grid.time) > DEPTH + 1]
        if (predicted := _predicted(grids[i], training)) is not None:
            errors[ARX] = _rms(record, _interpolated(record.time, grids[i].time, predicted))
        record_errors.append(errors)
    return record_errors


def _predicted(grid: TimedRecord, training: Sequence[TimedRecord]) -> Array | None:
    """The outputs of the ARX model at the grid of a record (R, J); None where there are too few
    rows.
    """
    middle = len(grid.time) // 2
    halves = [
        TimedRecord(*(part[rows] for part in grid)) for rows in (slice(middle), slice(middle, None))
    ]
    if training:
        return _run(grid, training) if len(grid.time) > DEPTH + 1 else None
    if middle <= DEPTH + 1:
        return None
    return np.concatenate([_run(halves[0], halves[1:]), _run(halves[1], halves[:1])])


def _run(grid: TimedRecord, known: Sequence[TimedRecord]) -> Array:
    measured = np.concatenate([record.outputs for record in known])
    margin = LIMIT_MARGIN * np.ptp(measured, axis=0)
    runs = [(record.outputs, record.inputs) for record in known]
    low = measured.min(axis=0) - margin
    high = measured.max(axis=0) + margin
    model = fit_arx(runs, low, high)
    past = grid.outputs[:DEPTH]
    following = model.free_run(past[None], grid.inputs[None])[0]
    return np.concatenate([past, following])


def _rms(record: TimedRecord, predicted: Array) -> Array:
    squares = np.where(record.compared, predicted - record.outputs, 0.0) ** 2
    return np.asarray(np.sqrt(squares.sum(axis=0) / np.maximum(record.compared.sum(axis=0), 1)))
