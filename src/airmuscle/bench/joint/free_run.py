"""Free run of an arm over windows: errors against the horizon, bands, and the baselines that a model must beat."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...core.arrays import Array
from ...engine import RungeKutta4, simulate_batch
from ...physics import PressureDriven
from .. import baselines
from ..baselines import ARX, DEPTH, PERSISTENCE
from .descent import SUBSTEPS
from .episodes import HISTORY, Episodes, Windows, WindowSignal, cut, start_of

COVERAGE = 0.95
"""Share of the errors that a band holds."""


def free_run(arm: PressureDriven, windows: Windows) -> Array:
    """Angles (N, rows, J) [rad] from the start of every window and the pressures alone, all joints at once.

    A run that fails keeps the angles of its start.
    """
    found = angles(arm, windows.pressure[:, HISTORY:], start_of(arm, windows), windows.sample_time)[:, 1:]
    kept = windows.angle[:, HISTORY : HISTORY + 1]
    return np.where(np.isfinite(found) & (np.abs(found - kept) < 2 * np.pi), found, kept)


def angles(arm: PressureDriven, pressure: Array, start: Mapping[str, Array], sample_time: float) -> Array:
    """Angles (N, R, J) [rad] under the pressures (N, R, M) from states (N,)."""
    names, rows = [c.name for c in arm.mechanism.coordinates], pressure.shape[1]
    run = simulate_batch(
        arm, {}, [WindowSignal(np.ascontiguousarray(p), sample_time) for p in pressure],
        duration=(rows - 1) * sample_time, initial_states=start, output_times=sample_time * np.arange(rows),
        integrator=RungeKutta4(sample_time / SUBSTEPS), keep=names,
    )  # fmt: skip
    return np.stack([run[name] for name in names], axis=-1)


def rms(errors: Array, axis: tuple[int, ...] = (0, 1)) -> Array:
    """Root mean square of errors (N, rows, J) over windows and rows, per joint."""
    return np.asarray(np.sqrt(np.mean(errors**2, axis=axis)))


def band(errors: Array) -> Array:
    """Half-width (rows, J) of the band that holds COVERAGE of these errors at every row, growing with the horizon."""
    level = min(1.0, COVERAGE * (1 + 1 / len(errors)))  # so that it holds for one further window, too
    return np.asarray(np.maximum.accumulate(np.quantile(np.abs(errors), level, axis=0, method="higher"), axis=0))


def coverage(errors: Array, episode: Array) -> Array:
    """Share (J,) of errors inside a band that comes from the other half of the episodes, both ways."""
    odd = np.searchsorted(np.unique(episode), episode) % 2 == 1
    held = [np.abs(errors[part]) <= band(errors[~part]) for part in (odd, ~odd)]
    return np.asarray(np.mean(np.concatenate(held), axis=(0, 1)))


# Baselines: persistence, and a linear ARX model of all joints

LIMIT = 9.0
"""Limit of an angle [rad], so that an unstable prediction ends in a large error and not in infinity."""

Predict = Callable[[Windows], Array]


def baseline_errors(train: Episodes, judge: Episodes, rows: int) -> Mapping[str, Array]:
    """Errors (N, rows, J) [rad] of the free run of each baseline over the windows of `judge`, by its name."""
    windows = cut(judge, 0, rows)
    known = {PERSISTENCE: persistence, ARX: fit_arx(train)}
    return {name: predict(windows) - windows.angle[:, HISTORY + 1 :] for name, predict in known.items()}


def persistence(windows: Windows) -> Array:
    """The angles at the start of every window, for all its rows."""
    return np.repeat(windows.angle[:, HISTORY : HISTORY + 1], windows.rows, axis=1)


def fit_arx(train: Episodes) -> Predict:
    """Linear ARX model of the angles of all joints, driven by all pressures."""
    runs = [(run.angle, run.pressure) for run in train.runs if len(run) > DEPTH + 1]
    model, begin = baselines.fit_arx(runs, -LIMIT, LIMIT), HISTORY - DEPTH + 1
    return lambda windows: model.free_run(windows.angle[:, begin : HISTORY + 1], windows.pressure[:, begin:])
