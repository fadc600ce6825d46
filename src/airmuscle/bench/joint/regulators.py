"""Pressures from commands: a proportional regulator for each muscle, identified from its command and its pressure."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from ...core.arrays import Array
from .episodes import HISTORY, ROWS, Episodes, Windows, cut

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
