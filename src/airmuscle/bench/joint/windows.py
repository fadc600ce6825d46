"""Windows of multiple shooting: pieces of episodes that start from measured angles, and their initial states."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np

from ...core.arrays import Array
from ...core.errors import IdentificationError
from ...engine import InputSignal, PiecewiseLinear
from ...physics import PressureDriven, WithStickSlip
from .episodes import Episodes, speed_of

HISTORY, ROWS = 10, 40
"""Rows before the start of a window, from which pressures and bristles are settled, and rows of its prediction."""


@dataclasses.dataclass(frozen=True, eq=False)
class Windows:
    """N windows of HISTORY + 1 + `rows` rows; row HISTORY is the start.

    angle, speed, rate (N, R, J), pressure (N, R, M); `speed` as measured, `rate` from the angles; `episode` and
    `first` (N,): number of the episode and its row at the start.
    """

    angle: Array
    speed: Array
    rate: Array
    pressure: Array
    episode: Array
    first: Array
    sample_time: float

    def __len__(self) -> int:
        return len(self.angle)

    @property
    def rows(self) -> int:
        """Rows of the prediction."""
        return int(self.angle.shape[1]) - HISTORY - 1

    @functools.cached_property
    def acceleration(self) -> Array:
        """Accelerations [rad/s^2] of the joints (N, R, J): smoothed differences."""
        slope = np.gradient(self.rate, self.sample_time, axis=1)
        padded = np.pad(slope, ((0, 0), (2, 2), (0, 0)), mode="edge")
        weights = (1 / 9, 2 / 9, 3 / 9, 2 / 9, 1 / 9)
        count = self.angle.shape[1]
        pieces = [w * padded[:, i : i + count] for i, w in enumerate(weights)]
        return np.asarray(np.sum(pieces, axis=0))

    def part(self, which: Sequence[int] | Array, rows: int | None = None) -> Windows:
        """Some of the windows, with the first `rows` rows of their predictions."""
        end = None if rows is None else HISTORY + 1 + rows
        columns = {n: getattr(self, n)[which][:, :end] for n in ("angle", "speed", "rate", "pressure")}
        return dataclasses.replace(self, **columns, episode=self.episode[which], first=self.first[which])


def cut(episodes: Episodes, delay: int = 0, rows: int = ROWS, stride: int = ROWS) -> Windows:
    """The windows that begin at rows HISTORY, HISTORY + stride, ... of every episode while `rows` further rows follow.

    Pressures are read `delay` rows later, because their sensors lag; the last reading of a window is then held. Raises
    IdentificationError if no episode is long enough.
    """
    found = [
        (number, k) for number, run in enumerate(episodes.runs) for k in range(HISTORY, len(run) - rows - 1, stride)
    ]
    if not found:
        longest = max(len(run) for run in episodes.runs)
        raise IdentificationError(
            f"no episode is as long as a window: the longest has {longest} rows, a window needs {HISTORY + rows + 2} "
            f"({HISTORY} before its start). Give longer episodes, or a shorter horizon (--horizon)."
        )
    rates = {number: speed_of(episodes.runs[number].angle, episodes.sample_time) for number, _ in found}
    later = {n: _shifted(episodes.runs[n].pressure, delay) for n in rates}

    def piece(array: Array, k: int) -> Array:
        return array[k - HISTORY : k + rows + 1]

    stacked = {
        "angle": np.array([piece(episodes.runs[n].angle, k) for n, k in found]),
        "speed": np.array([piece(episodes.runs[n].speed, k) for n, k in found]),
        "rate": np.array([piece(rates[n], k) for n, k in found]),
        "pressure": np.array([_held(piece(later[n], k), delay) for n, k in found]),
    }
    numbers = np.array(found)
    return Windows(**stacked, episode=numbers[:, 0], first=numbers[:, 1], sample_time=episodes.sample_time)


def _shifted(pressure: Array, delay: int) -> Array:
    return np.concatenate([pressure[delay:], np.repeat(pressure[-1:], delay, axis=0)]) if delay else pressure


def _held(piece: Array, delay: int) -> Array:
    """A window without the readings after its end, which a prediction does not have."""
    if not delay:
        return piece
    return np.concatenate([piece[:-delay], np.repeat(piece[-delay - 1 : -delay], delay, axis=0)])


@dataclasses.dataclass(frozen=True, eq=False)
class WindowSignal(InputSignal):
    """Inputs (R, m) at the rows of a window, linear between them; in the order of the inputs of the system."""

    values: Array
    sample_time: float

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        count = len(self.values) - 1
        times = start + self.sample_time * np.arange(1, count + 1)
        return PiecewiseLinear(
            np.asarray(times, dtype=np.float64),
            self.values[:-1].copy(),
            np.diff(self.values, axis=0) / self.sample_time,
        )


def start_of(arm: PressureDriven, windows: Windows) -> Mapping[str, Array]:
    """State of the arm (N,) at the start of every window: measured motion, settled bristles and pressures."""
    mechanism = arm.mechanism
    assert isinstance(mechanism, WithStickSlip)
    before, state = windows.angle[:, : HISTORY + 1], {}
    for j, (c, element) in enumerate(zip(mechanism.coordinates, mechanism.elements, strict=True)):
        state[c.name], state[c.speed] = before[:, -1, j], windows.speed[:, HISTORY, j]
        state[mechanism.inner_states[j].name] = _bristle(before[:, :, j], element.presliding_angle)
    for i, (prefix, lag) in enumerate(zip(arm.prefixes, arm.lags, strict=True)):
        readings = windows.pressure[:, : HISTORY + 1, i]
        state[f"{prefix}pressure"] = _lagged(readings, lag, windows.sample_time)
    return state


def _bristle(angle: Array, presliding: float) -> Array:
    """Deflection of a bristle that was relaxed at the first of these rows (N, R)."""
    z = np.zeros(len(angle))
    for step in np.diff(angle, axis=1).T:
        side, share = np.sign(step), np.exp(-np.abs(step) / presliding)
        z = side + (z - side) * share
    return z


def _lagged(reading: Array, lag: float, sample_time: float) -> Array:
    """Pressure behind readings (N, R) that are linear between the rows: the exact response of a first-order lag."""
    p, share = reading[:, 0].copy(), np.exp(-sample_time / lag)
    for before, after in zip(reading[:, :-1].T, reading[:, 1:].T, strict=True):
        slope = (after - before) / sample_time
        p = after - slope * lag + (p - before + slope * lag) * share
    return p
