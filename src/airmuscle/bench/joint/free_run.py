"""Free run of an arm over windows, from pressures or commands: errors against the horizon, bands and baselines."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from ...core.arrays import Array
from ...engine import RungeKutta4, simulate_batch
from ...physics import PressureDriven
from .. import baselines
from ..baselines import ARX, DEPTH, PERSISTENCE
from .descent import SUBSTEPS
from .episodes import HISTORY, ROWS, Episodes, Windows, WindowSignal, cut, start_of

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


# Pressures from commands: a proportional regulator for each muscle, identified from its command and its pressure

DELAYS = (0, 1, 2, 3)
"""Delays of the command [rows] that are tried."""
START, LOW, HIGH = (0.6, 0.6, 0.3, 0.3), (0.05, 0.05, 0.0, 0.0), (1.0, 1.0, 2.0, 2.0)
"""First values and limits of both shares and both corrections (chosen)."""
UNIT, ROBUST, SAMPLE = 1e5, 0.1, 400
"""Unit of the pressures in the search [Pa], its errors that count less, and number of its windows (chosen)."""
TRIED, REFINED = 20, 40
"""Evaluations for each delay and kind of the commands, and for the best of them (chosen)."""


@dataclasses.dataclass(frozen=True)
class RegulatorLag:
    """Two first-order lags in series behind a limited level, row by row, for one muscle.

    c = clip(c + K u, c_min, c_max) where commands u are increments, c = clip(c_0 + K u, ...) where they are levels;
    x += a_1 (c - x),   p += a_2 (x - p). While the pressure is measured, its error e corrects c and x by k_c e and
    k_x e, and p is the reading. `values`: K, a_1, a_2, k_c, k_x, c_min, c_max [1e5 Pa], and c_0; `delay` of the command
    in rows. The form is chosen.
    """

    values: tuple[float, ...]
    delay: int
    increments: bool

    def pressures(self, pressure: Array, command: Array) -> Array:
        """Pressures (N, R) [Pa] whose first HISTORY + 1 rows are the readings, and the others follow from commands."""
        gain, first, second, to_level, to_pilot, low, high, zero = self.values
        found = pressure / UNIT
        level, pilot, p = found[:, 0], found[:, 0], found[:, 0]
        for k in range(1, found.shape[1]):
            step = gain * command[:, max(k - self.delay, 0)]
            level = np.clip(level + step if self.increments else zero + step, low, high)
            pilot = pilot + first * (level - pilot)
            p = p + second * (pilot - p)
            if k <= HISTORY:
                error, p = found[:, k] - p, found[:, k]
                level, pilot = level + to_level * error, pilot + to_pilot * error
            else:
                found[:, k] = p
        return found * UNIT


def fit_regulator_lags(episodes: Episodes, rows: int = ROWS) -> tuple[RegulatorLag, ...]:
    """The regulator of each muscle whose pressures over `rows` further rows are nearest to the measured ones.

    Empty if an episode has no commands.
    """
    if any(run.command is None for run in episodes.runs):
        return ()
    pressure, command = cut(episodes, 0, rows).pressure, _commands(episodes, rows)
    some = np.linspace(0, len(pressure) - 1, min(SAMPLE, len(pressure))).astype(int)
    columns = zip(pressure[some].transpose(2, 0, 1), command[some].transpose(2, 0, 1), strict=True)
    return tuple(_fit(p, u) for p, u in columns)


def _fit(p: Array, u: Array) -> RegulatorLag:
    low, high = np.quantile(p, (0.01, 0.99)) / UNIT
    spread = high - low + 1e-6

    def search(model: RegulatorLag, evaluations: int) -> tuple[float, RegulatorLag]:
        def errors(values: Array) -> Array:
            found = dataclasses.replace(model, values=tuple(values.tolist())).pressures(p, u)
            return (found - p)[:, HISTORY + 1 :].ravel() / UNIT

        fit = least_squares(
            errors, model.values, loss="soft_l1", f_scale=ROBUST, max_nfev=evaluations,
            bounds=([-np.inf, *LOW, low - spread, high - spread / 2, -np.inf],
                    [np.inf, *HIGH, low + spread / 2, high + spread, np.inf]),
            x_scale=np.maximum(np.abs(model.values), 0.1),
        )  # fmt: skip
        return float(fit.cost), dataclasses.replace(model, values=tuple(fit.x.tolist()))

    gains = np.array([np.std(np.diff(p)), np.std(p)]) / UNIT / max(float(np.std(u)), 1e-12)
    first = [
        RegulatorLag((gain, *START, low, high, float(np.mean(p / UNIT - gain * u))), delay, increments)
        for gain, increments in zip(gains.tolist(), (True, False), strict=True)
        for delay in DELAYS
    ]
    trials = [search(model, TRIED) for model in first]
    return search(min(trials, key=lambda trial: trial[0])[1], REFINED)[1]


def from_commands(regulators: Sequence[RegulatorLag], episodes: Episodes, delay: int, rows: int) -> Windows:
    """The windows of `cut`, in which the pressures after the start follow from the commands."""
    windows, command = cut(episodes, 0, rows), _commands(episodes, rows)
    found = [r.pressures(windows.pressure[:, :, i], command[:, :, i]) for i, r in enumerate(regulators)]
    later = np.minimum(np.arange(HISTORY + 1 + rows) + delay, HISTORY + rows)
    return dataclasses.replace(windows, pressure=np.stack(found, axis=-1)[:, later])


def _commands(episodes: Episodes, rows: int) -> Array:
    """Commands (N, R, M) in the windows of `cut`."""
    runs = [dataclasses.replace(run, pressure=cast(Array, run.command)) for run in episodes.runs]
    return cut(dataclasses.replace(episodes, runs=tuple(runs)), 0, rows).pressure
