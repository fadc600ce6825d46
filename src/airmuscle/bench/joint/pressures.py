"""Pressures of the muscles of an arm: readings that saturate, and regulators between commands and pressures."""

import dataclasses
from collections.abc import Sequence
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from ...core import Array
from .episodes import HISTORY, ROWS, Episodes, Windows, cut, rms

SATURATED = 0.02
"""Share of rows exactly at an end of the range of a reading that counts as saturation (chosen)."""
SETTLED, LEAST = 3, 0.2
"""Rows after which a wrong reading is forgotten before the start of a window; least share of rows of a fit (chosen)."""


def saturated(episodes: Episodes) -> tuple[Array, list[str]]:
    """Upper ends (M,) of the readings at which they saturate, infinite without one, and remarks on both ends."""
    top, remarks = np.full(episodes.muscles, np.inf), []
    for i, values in enumerate(episodes.rows("pressure").T):
        ends = ((values.min(), "the muscle is empty"), (values.max(), "it has the pressure of its supply"))
        for edge, cause in ends if np.ptp(values) > 0.0 else ():
            count = int(np.sum(values == edge))
            if count > SATURATED * len(values):
                remarks.append(
                    f"pressure {i + 1} is {edge:.4g} Pa in {count} of {len(values)} rows "
                    f"({100 * count / len(values):.0f} %): its reading saturates there, or {cause}"
                )
                top[i] = edge if edge == values.max() else np.inf
    return top, remarks


def without_saturated(windows: Windows, episodes: Episodes) -> tuple[Windows, list[str]]:
    """The windows of a fit, in which rows after a reading at an upper end at which it saturates do not count, and a
    remark on these; all rows count where less than LEAST would be left."""
    ends = np.any(windows.pressure[:, HISTORY - SETTLED :] >= saturated(episodes)[0], axis=-1)
    hit = np.cumsum(ends, axis=1)[:, SETTLED:] > 0
    few = hit[:, 1:].mean() <= 1.0 - LEAST
    text = (
        f"{hit[:, 1:].sum()} of {hit[:, 1:].size} rows of the fit follow a pressure reading at its upper end, whose "
        "true value is unknown: they "
        + ("do not count, except in the errors of the report" if few else "are too many to leave out")
    )
    counts = np.concatenate([windows.counts[:, :HISTORY], ~hit], axis=1)
    return dataclasses.replace(windows, counts=counts) if few else windows, [text] if hit.any() else []


# Pressures from commands: a proportional regulator for each muscle, identified from its command and its pressure

DELAYS = (0, 1, 2, 3)
"""Delays of the command [rows] that are tried; longer ones, up to HISTORY, where the longest is the best."""
UNEXPLAINED = 0.5
"""Error of the pressures from commands, relative to their changes, that is named (chosen)."""
START, LOW, HIGH = (0.6, 0.6, 0.3, 0.3), (0.05, 0.05, 0.0, 0.0), (1.0, 1.0, 2.0, 2.0)
"""First values and limits of both shares and both corrections (chosen)."""
UNIT, LEVEL, ROBUST, SAMPLE = 1e5, 3e5, 0.1, 400
"""Unit of the pressures in the search and a high one [Pa], errors that count less, number of its windows (chosen)."""
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
        found, step = pressure / UNIT, gain * command
        level, pilot, p = found[:, 0], found[:, 0], found[:, 0]
        for k in range(1, found.shape[1]):
            aim = (level if self.increments else zero) + step[:, max(k - self.delay, 0)]
            level = np.minimum(np.maximum(aim, low), high)  # np.clip takes ten times as long
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
    """The regulator of readings (N, R) in any unit; a high one is LEVEL, the deviation of commands 1 in the search."""
    scale, unit = (float(np.quantile(np.abs(p), 0.99)) or LEVEL) / LEVEL, float(np.std(u)) or 1.0
    p, u = p / scale, u / unit
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
    best, longest = min((search(model, TRIED) for model in first), key=lambda trial: trial[0]), DELAYS[-1]
    while best[1].delay == longest < HISTORY:
        longest += 1
        best = min(best, search(dataclasses.replace(best[1], delay=longest), TRIED), key=lambda trial: trial[0])
    found = search(best[1], REFINED)[1]
    gain, *shares = found.values[:5]
    return dataclasses.replace(found, values=(gain * scale / unit, *shares, *(scale * v for v in found.values[5:])))


def from_commands(regulators: Sequence[RegulatorLag], episodes: Episodes, delay: int, rows: int) -> Windows:
    """The windows of `cut`, in which the pressures after the start follow from the commands."""
    windows, command = cut(episodes, 0, rows), _commands(episodes, rows)
    found = [r.pressures(windows.pressure[:, :, i], command[:, :, i]) for i, r in enumerate(regulators)]
    later = np.minimum(np.arange(HISTORY + 1 + rows) + delay, HISTORY + rows)
    return dataclasses.replace(windows, pressure=np.stack(found, axis=-1)[:, later])


def unexplained(commanded: Windows, windows: Windows, pairs: Sequence[tuple[int, int]]) -> list[str]:
    """A remark on the muscles whose pressures hardly follow from their commands."""
    true, found = (each.pressure[:, HISTORY + 1 :] for each in (windows, commanded))
    errors, changes = rms(found - true), rms(true - windows.pressure[:, HISTORY : HISTORY + 1])
    muscles = zip((str(muscle) for pair in pairs for muscle in pair), errors > UNEXPLAINED * changes, strict=True)
    names = ", ".join(name for name, wrong in muscles if wrong)
    text = (
        f"the commands hardly explain the pressures of muscle {names}: they never vary, are of another muscle, or "
        f"act after more than {HISTORY} rows"
    )
    return [text] if names else []


def _commands(episodes: Episodes, rows: int) -> Array:
    """Commands (N, R, M) in the windows of `cut`."""
    runs = [dataclasses.replace(run, pressure=cast(Array, run.command)) for run in episodes.runs]
    return cut(dataclasses.replace(episodes, runs=tuple(runs)), 0, rows).pressure
