"""Episodes: short records of an arm, each with its own initial state, in SI units; and their
windows.
"""

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, IdentificationError, ParameterError, ShortRepr, counted
from ...engine import InputSignal, PiecewiseLinear
from ...physics import PressureDriven, WithStickSlip


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Episode(ShortRepr):
    """One run of an arm, n rows at one sample time.

    angle (n, J) [rad] and speed (n, J) [rad/s] of the joints, pressure (n, M) of the muscles [Pa,
    or counts times a scale], command (n, M) in any unit or None, name of its file or place in the
    file.
    """

    angle: Array
    speed: Array
    pressure: Array
    command: Array | None = None
    name: str = ""

    def __len__(self) -> int:
        return len(self.angle)


@dataclasses.dataclass(frozen=True, eq=False)
class Episodes:
    """Episodes of one arm with a common sample time [s], also a slice of others: `episodes[:2400]`;
    `notes` state what the reader has found or corrected, `confirmed` whether times or speeds of the
    record confirm the sample time.
    """

    runs: tuple[Episode, ...]
    sample_time: float
    notes: tuple[str, ...] = ()
    confirmed: bool = True

    def __post_init__(self) -> None:
        if not self.runs or not self.sample_time > 0.0:
            stated = f"{len(self.runs)} runs at a sample time of {self.sample_time:g} s are given"
            raise ParameterError(
                f"Episodes: {stated}; give one run at least and a sample time above 0."
            )
        if len(shapes := {(run.angle.shape[1], run.pressure.shape[1]) for run in self.runs}) > 1:
            different = f"runs have different numbers of joints and muscles, {sorted(shapes)}"
            raise ParameterError(f"Episodes: {different}; fit each arm alone.")

    def __len__(self) -> int:
        return len(self.runs)

    def __getitem__(self, part: slice) -> "Episodes":
        return dataclasses.replace(self, runs=self.runs[part])

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.runs[0].angle.shape[1])

    @property
    def muscles(self) -> int:
        """Number of muscles."""
        return int(self.runs[0].pressure.shape[1])

    def rows(self, name: str) -> Array:
        """The rows of all runs of one quantity: angle, speed, pressure or command."""
        return np.concatenate([getattr(run, name) for run in self.runs])


ENOUGH = 19
"""Episodes from which errors can hold 95 % of further ones: the greatest of n holds the next with
n/(n + 1).
"""


def count_fitted(episodes: Episodes, left_out: float | None) -> int:
    """Number of the episodes, the first ones, that are fitted while a share of them is left out: by
    default a tenth, or ENOUGH if that is more, but a third at most. Raises ParameterError."""
    count = len(episodes)
    share = min(max(0.1, ENOUGH / count), 1 / 3) if left_out is None else left_out
    if not 0.0 < share < 1.0 or count < 4:
        raise ParameterError(
            f"episodes: {count}, of which a share of {share:.3g} is left out; give 4 episodes or"
            " more, and a share between 0 and 1."
        )
    return max(1, round((1.0 - share) * count))


def speed_of(angle: Array, sample_time: float) -> Array:
    """Speed [rad/s] from angles (n, J): slope of a parabola through five rows."""
    if len(angle) < 5:
        return np.asarray(np.gradient(angle, sample_time, axis=0))
    weights = np.array([2.0, 1.0, 0.0, -1.0, -2.0]) / (10.0 * sample_time)
    slopes = [np.convolve(column, weights, "valid") for column in angle.T]
    inner = np.stack(slopes, axis=1)
    ends = np.gradient(angle, sample_time, axis=0)
    return np.concatenate([ends[:2], inner, ends[-2:]])


def join(parts: Sequence[Episodes]) -> Episodes:
    """Episodes of several files as one. Raises ParameterError for different sample times."""
    times = {round(part.sample_time, 6) for part in parts}
    if len(times) > 1:
        raise ParameterError(
            f"Episodes: files have different sample times [s], {sorted(times)}; fit each alone."
        )
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    runs = tuple(run for part in parts for run in part.runs)
    confirmed = all(part.confirmed for part in parts)
    return Episodes(runs, parts[0].sample_time, notes, confirmed)


def in_pairs(episodes: Episodes, pairs: Sequence[tuple[int, int]]) -> Episodes:
    """Episodes whose pressures stand in the order of the pairs."""
    order = [muscle for pair in pairs for muscle in pair]
    if min(order) < 1 or max(order) > episodes.muscles or len(set(order)) < len(order):
        raise ParameterError(
            f"fit_joint: pairs are {tuple(pairs)}; there are pressures 1 to {episodes.muscles},"
            " each in one pair."
        )
    return in_order(episodes, order)


def in_order(episodes: Episodes, columns: Sequence[int]) -> Episodes:
    """Episodes whose pressures and commands are those of these columns, from 1."""
    order = [column - 1 for column in columns]
    runs = []
    for run in episodes.runs:
        command = None if run.command is None else run.command[:, order]
        runs.append(dataclasses.replace(run, pressure=run.pressure[:, order], command=command))
    return dataclasses.replace(episodes, runs=tuple(runs))


# Windows of multiple shooting: pieces that start from measured angles, and their initial states

HISTORY = 10
ROWS = 40
"""Rows before the start of a window, from which pressures and bristles are settled, and rows of its
prediction.
"""


@dataclasses.dataclass(frozen=True, eq=False)
class Windows:
    """N windows of HISTORY + 1 + `rows` rows; row HISTORY is the start.

    angle, speed, rate (N, R, J), pressure (N, R, M); `speed` as measured, `rate` from the angles;
    `episode` and `first` (N,): number of the episode and its row at the start; `counts` (N, R):
    whether a row counts in a fit.
    """

    angle: Array
    speed: Array
    rate: Array
    pressure: Array
    episode: Array
    first: Array
    sample_time: float
    counts: Array

    def __len__(self) -> int:
        return len(self.angle)

    @property
    def rows(self) -> int:
        """Rows of the prediction."""
        return int(self.angle.shape[1]) - HISTORY - 1

    @functools.cached_property
    def acceleration(self) -> Array:
        """Accelerations [rad/s^2] of the joints (N, R, J): smoothed differences."""
        from scipy.ndimage import convolve1d

        slope = np.gradient(self.rate, self.sample_time, axis=1)
        weights = np.array([1, 2, 3, 2, 1]) / 9
        return np.asarray(convolve1d(slope, weights, axis=1, mode="nearest"))

    def part(self, which: Sequence[int] | Array, rows: int | None = None) -> "Windows":
        """Some of the windows, with the first `rows` rows of their predictions."""
        end = None if rows is None else HISTORY + 1 + rows
        columns = {
            n: getattr(self, n)[which][:, :end]
            for n in ("angle", "speed", "rate", "pressure", "counts")
        }
        return dataclasses.replace(
            self, **columns, episode=self.episode[which], first=self.first[which]
        )

    def sample(self, count: int, rows: int | None = None) -> "Windows":
        """At most `count` of the windows, evenly spaced, with the first `rows` rows of their
        predictions.
        """
        return self.part(np.linspace(0, len(self) - 1, min(count, len(self))).astype(int), rows)


def long_enough(episodes: Episodes, rows: int) -> tuple[Episodes, list[str]]:
    """The episodes that hold a window, and a remark on the others. Raises IdentificationError if
    none does.
    """
    needed = HISTORY + rows + 2
    runs = tuple(run for run in episodes.runs if len(run) >= needed)
    if not runs:
        raise IdentificationError(
            f"no episode is as long as a window: the longest has {max(map(len, episodes.runs))}"
            f" rows, a window needs {needed} ({HISTORY} before its start). Give longer episodes, or"
            " a shorter horizon (--horizon)."
        )
    short = [f"{run.name} ({len(run)} rows)" for run in episodes.runs if len(run) < needed]
    text = (
        f"{len(short)} of {counted(len(episodes), 'episode')}, shorter than a window of {needed}"
        f" rows, left out: {', '.join(short[:3])}{', ...' if len(short) > 3 else ''}"
    )
    return dataclasses.replace(episodes, runs=runs), [text] if short else []


def cut(episodes: Episodes, delay: int = 0, rows: int = ROWS, stride: int = ROWS) -> Windows:
    """The windows that begin at rows HISTORY, HISTORY + stride, ... of every episode while `rows`
    further rows follow. Pressures are read `delay` rows later, because their sensors lag; the last
    reading is held. Raises IdentificationError if no episode is long enough."""
    runs = episodes.runs
    step = episodes.sample_time
    window = np.arange(-HISTORY, rows + 1)
    later = np.minimum(window + delay, rows)
    starts = list[tuple[int, int]]()
    angle, speed, rate, pressure = (list[Array]() for _ in range(4))
    for number, run in enumerate(runs):
        firsts = range(HISTORY, len(run) - rows - 1, stride)
        if not firsts:
            continue
        rate_of_run = speed_of(run.angle, step)
        for first in firsts:
            starts.append((number, first))
            angle.append(run.angle[first + window])
            speed.append(run.speed[first + window])
            rate.append(rate_of_run[first + window])
            pressure.append(run.pressure[first + later])
    if not starts:
        long_enough(episodes, rows)  # raises
    episode, first_rows = np.array(starts).T
    angles = np.array(angle)
    return Windows(
        angles,
        np.array(speed),
        np.array(rate),
        np.array(pressure),
        episode,
        first_rows,
        step,
        np.ones(angles.shape[:2], dtype=bool),
    )


@dataclasses.dataclass(frozen=True, eq=False)
class WindowSignal(InputSignal):
    """Inputs (R, m) at the rows of a window, linear between them; in the order of the inputs of the
    system.
    """

    values: Array
    sample_time: float

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        times = np.asarray(
            start + self.sample_time * np.arange(1, len(self.values)), dtype=np.float64
        )
        return PiecewiseLinear(
            times, self.values[:-1].copy(), np.diff(self.values, axis=0) / self.sample_time
        )


def start_of(arm: PressureDriven, windows: Windows) -> Mapping[str, Array]:
    """State of the arm (N,) at the start of every window: measured motion, settled bristles and
    pressures.
    """
    state = {variable.name: np.zeros(len(windows)) for variable in arm.states}
    for j, coordinate in enumerate(arm.mechanism.coordinates):
        state[coordinate.name] = windows.angle[:, HISTORY, j]
        state[coordinate.speed] = windows.speed[:, HISTORY, j]
    if isinstance(arm.mechanism, WithStickSlip):
        state |= _settled_bristles(arm.mechanism, windows)
    return state | _settled_pressures(arm, windows)


def _settled_pressures(arm: PressureDriven, windows: Windows) -> dict[str, Array]:
    """Pressures (N,) behind the readings before every window."""
    readings = windows.pressure[:, : HISTORY + 1]
    columns = readings.transpose(2, 0, 1)
    settled = {}
    for prefix, lag, column in zip(arm.prefixes, arm.lags, columns, strict=True):
        settled[f"{prefix}pressure"] = lagged(column, lag, windows.sample_time)
    return settled


def _settled_bristles(mechanism: WithStickSlip, windows: Windows) -> dict[str, Array]:
    """Deflections (N,) of the bristles after the rows before every window."""
    before = windows.angle[:, : HISTORY + 1]
    settled = {}
    for j, element in enumerate(mechanism.elements):
        bristle = mechanism.inner_states[j]
        settled[bristle.name] = _bristle(before[:, :, j], element.presliding_angle)
    return settled


def _bristle(angle: Array, presliding: float) -> Array:
    """Deflection of a bristle that was relaxed at the first of these rows (N, R)."""
    z = np.zeros(len(angle))
    for step in np.diff(angle, axis=1).T:
        side = np.sign(step)
        share = np.exp(-np.abs(step) / presliding)
        z = side + (z - side) * share
    return z


def lagged(reading: Array, lag: float, sample_time: float) -> Array:
    """Pressure behind readings (N, R) that are linear between the rows: the exact response of a
    first-order lag.
    """
    p = reading[:, 0].copy()
    share = np.exp(-sample_time / lag)
    for before, after in zip(reading[:, :-1].T, reading[:, 1:].T, strict=True):
        slope = (after - before) / sample_time
        p = after - slope * lag + (p - before + slope * lag) * share
    return p


# Errors over windows

COVERAGE = 0.95
"""Share of the errors that a band holds."""


def rms(errors: Array, axis: tuple[int, ...] = (0, 1)) -> Array:
    """Root mean square of errors (N, rows, J) over windows and rows, per joint."""
    return np.asarray(np.sqrt(np.mean(errors**2, axis=axis)))


def band(errors: Array) -> Array:
    """Half-width (rows, J) of the band that holds COVERAGE of these errors at every row, growing
    with the horizon.
    """
    level = min(
        1.0, COVERAGE * (1 + 1 / len(errors))
    )  # so that it holds for one further window, too
    return np.asarray(
        np.maximum.accumulate(np.quantile(np.abs(errors), level, axis=0, method="higher"), axis=0)
    )


def coverage(errors: Array, episode: Array) -> Array:
    """Share (J,) of errors inside a band that comes from the other half of the episodes, both
    ways.
    """
    odd = np.searchsorted(np.unique(episode), episode) % 2 == 1
    if odd.all() or not odd.any():
        return np.full(errors.shape[2], np.nan)
    inside = []
    for part in (odd, ~odd):
        limits = band(errors[~part])
        inside.append(np.abs(errors[part]) <= limits)
    return np.asarray(np.mean(np.concatenate(inside), axis=(0, 1)))
