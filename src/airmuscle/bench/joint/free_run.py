"""Free run of an arm over windows: its baselines, regulators that lead to it from commands, and the
residual that physics leaves in it."""

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, cast

import numpy as np

from ...core import Array, ShortRepr, tree
from ...physics import GaussianResidual, PressureDriven, WithStickSlip
from ..estimation import (
    Accuracy,
    FreeParameter,
    MeasuredProblem,
    ProblemSearch,
    Runs,
    SampledDescent,
    SearchStage,
    SoftL1,
)
from ..prediction import ARX, DEPTH, PERSISTENCE, fit_arx
from .descent import JointProblem, with_slopes
from .episode_inspection import without_saturated
from .episodes import HISTORY, ROWS, Episodes, Windows, cut, rms, start_of


def free_run(arm: PressureDriven, windows: Windows) -> Array:
    """Angles (N, rows, J) [rad] from the start of every window, which a run that fails keeps, and
    pressures alone.
    """
    simulated = angles(
        arm, windows.pressure[:, HISTORY:], start_of(arm, windows), windows.sample_time
    )[:, 1:]
    start_angle = windows.angle[:, HISTORY : HISTORY + 1]
    return np.where(
        np.isfinite(simulated) & (np.abs(simulated - start_angle) < 2 * np.pi),
        simulated,
        start_angle,
    )


def run_errors(arm: PressureDriven, windows: Windows) -> Array:
    """Errors (N, rows, J) [rad] of the free run of all joints."""
    return free_run(arm, windows) - windows.angle[:, HISTORY + 1 :]


def free_errors(arm: PressureDriven, joint: int, windows: Windows) -> Array:
    """Errors (N, rows) [rad] of one joint in the free run of all joints."""
    return np.asarray(run_errors(arm, windows)[..., joint])


def angles(
    arm: PressureDriven, pressure: Array, start: Mapping[str, Array], sample_time: float
) -> Array:
    """Angles (N, R, J) [rad] under the pressures (N, R, M) from states (N,)."""
    return with_slopes(
        arm, (), pressure, sample_time, start, [c.name for c in arm.mechanism.coordinates]
    )[0]


# Baselines: persistence, and a linear ARX model of all joints

LIMIT = 9.0
"""Limit of an angle [rad], so that an unstable prediction ends in a large error and not in
infinity.
"""


def baseline_errors(train: Episodes, judge: Episodes, rows: int) -> Mapping[str, Array]:
    """Errors (N, rows, J) [rad] of the free run of each baseline over the windows of `judge`, by
    its name.
    """
    windows = cut(judge, 0, rows)
    begin = HISTORY - DEPTH + 1
    past = windows.angle[:, begin : HISTORY + 1]
    start = windows.angle[:, HISTORY : HISTORY + 1]
    measured = windows.angle[:, HISTORY + 1 :]
    training = [(run.angle, run.pressure) for run in train.runs if len(run) > DEPTH + 1]
    arx = fit_arx(training, -LIMIT, LIMIT)
    predicted = arx.free_run(past, windows.pressure[:, begin:])
    return {PERSISTENCE: start - measured, ARX: predicted - measured}


# Pressures from commands: a proportional regulator for each muscle, identified from its command and
# its pressure

DELAYS = (0, 1, 2, 3)
"""Delays of the command [rows] that are tried; longer ones, up to HISTORY, where the longest is the
best.
"""
UNEXPLAINED = 0.5
"""Error of the pressures from commands, relative to their changes, that is named (chosen)."""
START = (0.6, 0.6, 0.3, 0.3)
LOW = (0.05, 0.05, 0.0, 0.0)
HIGH = (1.0, 1.0, 2.0, 2.0)
"""First values and limits of both shares and both corrections (chosen)."""
UNIT = 1e5
LEVEL = 3e5
ROBUST = 0.1
SAMPLE = 400
"""Unit of the pressures in the search and a high one [Pa], errors that count less, number of its
windows (chosen).
"""
STEP = 1.5e-8
"""Relative step of the derivatives by the values: the root of the rounding."""
VALUES = ("K", "a_1", "a_2", "k_c", "k_x", "c_min", "c_max", "c_0")
TRIED = 20
REFINED = 40
"""Evaluations for each delay and kind of the commands, and for the best of them (chosen)."""


@dataclasses.dataclass(frozen=True)
class RegulatorLag:
    """Two first-order lags in series behind a limited level, row by row, for one muscle.

    c = clip(c + K u, c_min, c_max) where commands u are increments, c = clip(c_0 + K u, ...) where
    they are levels;
    x += a_1 (c - x),   p += a_2 (x - p). While the pressure is measured, its error e corrects c and
                        x by k_c e and
    k_x e, and p is the reading. `values`: K, a_1, a_2, k_c, k_x, c_min, c_max [1e5 Pa], and c_0;
    `delay` of the command in rows. The form is chosen.
    """

    values: tuple[float, ...]
    delay: int
    increments: bool

    def pressures(self, pressure: Array, command: Array) -> Array:
        """Pressures (N, R) [Pa] whose first HISTORY + 1 rows are the readings, and the others
        follow from commands.
        """
        gain, first, second, to_level, to_pilot, low, high, zero = self.values
        modelled = pressure / UNIT
        step = (gain * command.T).T
        level = modelled[:, 0]
        pilot = modelled[:, 0]
        p = modelled[:, 0]
        for k in range(1, modelled.shape[1]):
            aim = (level if self.increments else zero) + step[:, max(k - self.delay, 0)]
            level = np.minimum(np.maximum(aim, low), high)  # np.clip takes ten times as long
            pilot = pilot + first * (level - pilot)
            p = p + second * (pilot - p)
            if k <= HISTORY:
                error = modelled[:, k] - p
                p = modelled[:, k]
                level = level + to_level * error
                pilot = pilot + to_pilot * error
            else:
                modelled[:, k] = p
        return modelled * UNIT


class RegulatorLimits(NamedTuple):
    """Bounds of the values of a regulator."""

    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class RegulatorLagProblem(MeasuredProblem):
    """The pressures of windows (N, R) after their start, and the values of the regulator that gives
    them.
    """

    model: RegulatorLag
    pressure: Array
    command: Array
    limits: RegulatorLimits
    name = "regulator"
    origin = "episodes"
    quantity = "pressure"
    accuracy = Accuracy(1e-8, 1e-10)

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        rows = zip(VALUES, self.model.values, self.limits.low, self.limits.high, strict=True)
        return tuple(
            FreeParameter(name, name, value, (low, high), "", "", size=max(abs(value), 0.1))
            for name, value, low, high in rows
        )

    @functools.cached_property
    def target(self) -> Array:  # type: ignore[override]
        return self.pressure[:, HISTORY + 1 :].ravel() / UNIT

    @functools.cached_property
    def runs(self) -> Runs:
        """The window of each reading."""
        count, rows = self.pressure.shape
        window = np.repeat(np.arange(count), rows - HISTORY - 1)
        return Runs(window, np.zeros(window.size, dtype=np.intp), in_time=True)

    def describe_row(self, row: int) -> str:
        window, place = divmod(row, self.pressure.shape[1] - HISTORY - 1)
        return f"row {place + 1} of window {window + 1}"

    def regulator(self, values: Array) -> RegulatorLag:
        """The regulator with these values."""
        return dataclasses.replace(self.model, values=tuple(values.tolist()))

    def predict(self, values: Array) -> Array:
        return self._pressures(self.regulator(values), self.pressure, self.command).ravel()

    @staticmethod
    def _pressures(model: RegulatorLag, pressure: Array, command: Array) -> Array:
        return model.pressures(pressure, command)[:, HISTORY + 1 :] / UNIT

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        """Differences of all values in one run: as many regulators side by side."""
        chosen = range(len(values)) if which is None else which
        trials = [values]
        steps = []
        for i in chosen:
            step = STEP * max(abs(float(values[i])), 0.1)
            step = -step if values[i] + step > self.limits.high[i] else step
            trials.append(np.where(np.arange(len(values)) == i, values + step, values))
            steps.append(step)
        count = len(self.pressure)
        side_by_side = np.repeat(np.array(trials), count, axis=0).T
        model = dataclasses.replace(self.model, values=tuple(side_by_side))
        repeated = [np.tile(column, (len(trials), 1)) for column in (self.pressure, self.command)]
        modelled = self._pressures(model, *repeated).reshape(len(trials), -1)
        return np.asarray(((modelled[1:] - modelled[0]) / np.array(steps)[:, None]).T)


def fit_regulator_lags(episodes: Episodes, rows: int = ROWS) -> tuple[RegulatorLag, ...]:
    """The regulator of each muscle whose pressures over `rows` further rows are nearest to the
    measured ones. Empty if an episode has no commands."""
    if any(run.command is None for run in episodes.runs):
        return ()
    pressure = cut(episodes, 0, rows).pressure
    command = _commands(episodes, rows)
    sampled = np.linspace(0, len(pressure) - 1, min(SAMPLE, len(pressure))).astype(int)
    columns = zip(
        pressure[sampled].transpose(2, 0, 1), command[sampled].transpose(2, 0, 1), strict=True
    )
    return tuple(_fit(p, u) for p, u in columns)


def _fit(p: Array, u: Array) -> RegulatorLag:
    """The regulator of readings (N, R) in any unit; a high one is LEVEL, the deviation of commands
    1 in the search.
    """
    scale = (float(np.quantile(np.abs(p), 0.99)) or LEVEL) / LEVEL
    unit = float(np.std(u)) or 1.0
    p = p / scale
    u = u / unit
    low, high = np.quantile(p, (0.01, 0.99)) / UNIT
    spread = high - low + 1e-6

    limits = RegulatorLimits(
        (-np.inf, *LOW, low - spread, high - spread / 2, -np.inf),
        (np.inf, *HIGH, low + spread / 2, high + spread, np.inf),
    )

    def search(model: RegulatorLag, evaluations: int) -> tuple[float, RegulatorLag]:
        problem = RegulatorLagProblem(model, p, u, limits)
        start = ProblemSearch(problem, SoftL1(ROBUST), problem.initial_values)
        found = start.check_start().run(evaluations)
        return found.cost, problem.regulator(found.values)

    gains = np.array([np.std(np.diff(p)), np.std(p)]) / UNIT / max(float(np.std(u)), 1e-12)
    first = [
        RegulatorLag(
            (gain, *START, low, high, float(np.mean(p / UNIT - gain * u))), delay, increments
        )
        for gain, increments in zip(gains.tolist(), (True, False), strict=True)
        for delay in DELAYS
    ]
    best = min((search(model, TRIED) for model in first), key=lambda trial: trial[0])
    longest = DELAYS[-1]
    while best[1].delay == longest < HISTORY:
        longest += 1
        best = min(
            best,
            search(dataclasses.replace(best[1], delay=longest), TRIED),
            key=lambda trial: trial[0],
        )
    refined = search(best[1], REFINED)[1]
    gain, *shares = refined.values[:5]
    return dataclasses.replace(
        refined, values=(gain * scale / unit, *shares, *(scale * v for v in refined.values[5:]))
    )


def from_commands(
    regulators: Sequence[RegulatorLag],
    episodes: Episodes,
    delay: int,
    rows: int,
    pairs: Sequence[tuple[int, int]],
) -> tuple[Windows, list[str]]:
    """The windows of `cut`, in which the pressures after the start follow from the commands, and a
    remark on muscles whose pressures hardly do."""
    windows = cut(episodes, 0, rows)
    command = _commands(episodes, rows)
    modelled = [
        r.pressures(windows.pressure[:, :, i], command[:, :, i]) for i, r in enumerate(regulators)
    ]
    later = np.minimum(np.arange(HISTORY + 1 + rows) + delay, HISTORY + rows)
    commanded = np.stack(modelled, axis=-1)[:, later]
    true = windows.pressure[:, later]
    errors = rms((commanded - true)[:, HISTORY + 1 :])
    changes = rms(true[:, HISTORY + 1 :] - true[:, HISTORY : HISTORY + 1])
    muscles = zip(
        (str(muscle) for pair in pairs for muscle in pair),
        errors > UNEXPLAINED * changes,
        strict=True,
    )
    names = ", ".join(name for name, wrong in muscles if wrong)
    text = (
        f"the commands hardly explain the pressures of muscle {names}: they never vary, are of"
        f" another muscle, or act after more than {HISTORY} rows"
    )
    return dataclasses.replace(windows, pressure=commanded), [text] if names else []


def _commands(episodes: Episodes, rows: int) -> Array:
    """Commands (N, R, M) in the windows of `cut`."""
    runs = [dataclasses.replace(run, pressure=cast(Array, run.command)) for run in episodes.runs]
    return cut(dataclasses.replace(episodes, runs=tuple(runs)), 0, rows).pressure


# Hybrid law: what physics leaves in the free run, fitted as a residual and judged on episodes held
# back

CENTRES = 100
"""Number of centres, rows of the fitted episodes drawn at random (chosen)."""
RIDGES = (50.0, 5.0)
"""Weights of the ridge towards no residual that are tried, the strongest first (chosen)."""
SEARCH_OF_RESIDUAL = SearchStage(40, 20, 240)
"""The search with each ridge, from the result of the one before (chosen)."""
HELD_BACK = 0.1
"""Share of the fitted episodes, the last ones, that chooses the ridge and the joints with a
residual (chosen).
"""
FAR = 0.05
GAIN = 0.15
LOSS = 0.05
"""Share of the windows, by the distance of their episodes, that counts as far from the data; gain
and loss of a law that is accepted."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ResidualGain(ShortRepr):
    """Errors (N, rows, J) [rad] of the free run of physics alone and of the hybrid law over the
    same windows.

    distance (N,) of the episode of each window from the centres of the residual, relative to its
    scales.
    """

    physics: Array
    hybrid: Array
    distance: Array

    def change(self, far: bool) -> Array:
        """Relative change (J,) of the rms error by the residual, far from the data or near it."""
        which = (self.distance >= np.quantile(self.distance, 1.0 - FAR, method="lower")) == far
        return np.asarray(rms(self.hybrid[which]) / rms(self.physics[which]) - 1.0)

    def accepts(self, joint: int) -> bool:
        """Whether a joint gains GAIN near the data, loses LOSS at most far from it, and no other
        loses more.
        """
        near = self.change(far=False)
        far = self.change(far=True)
        return bool(near[joint] <= -GAIN and far[joint] <= LOSS and np.all(near <= LOSS))

    def __str__(self) -> str:
        near, far = (
            ", ".join(f"{100 * c:+.0f}" for c in self.change(far)) for far in (False, True)
        )
        return (
            f"{near} % of the rms error of joints 1 to {self.hybrid.shape[2]} near the data, {far}"
            " % far from it"
        )


def fit_residual(
    arm: PressureDriven,
    episodes: Episodes,
    *,
    delay: int = 0,
    rows: int = ROWS,
    centres: int = CENTRES,
    seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[PressureDriven, list[int]]:
    """The arm with a residual, joint after joint, and the joints (from 1) whose gain episodes held
    back confirm.

    arm      with stick-slip; its pressures are those of the episodes, in their order, `delay` rows
             later
    centres  number of the Gaussian functions

    Physics stays as it is. The ridge draws towards the residual of the joints before; of its
    weights that episodes held back confirm, the one with the smallest error of the joint there is
    taken. A residual without any joint is zero.
    """
    split = max(1, round((1.0 - HELD_BACK) * len(episodes)))
    every = cut(episodes[:split], delay, rows, stride=max(1, rows // 2))
    held_back = cut(episodes[split:], delay, rows)
    train, _ = without_saturated(every, episodes)
    residual = _gaussian_residual(arm, episodes[:split], centres, seed)
    accepted = list[int]()
    hybrid_mechanism = dataclasses.replace(cast(WithStickSlip, arm.mechanism), residual=residual)
    accepted_arm = dataclasses.replace(arm, mechanism=hybrid_mechanism)
    far = distance(accepted_arm, held_back)
    for joint in range(episodes.joints):
        before = run_errors(accepted_arm, held_back)
        trials = []
        count = len(residual.energies)
        paths = [f"mechanism.residual.energies[{k}]" for k in range(count)]
        paths += [f"mechanism.residual.friction_logs[{joint * count + k}]" for k in range(count)]
        values = {leaf.path: float(leaf.value) for leaf in tree.leaves(accepted_arm)}
        prior = {path: values[path] for path in paths}
        problem = JointProblem(accepted_arm, train, joint, tuple(paths), seed, prior)
        search = SampledDescent(problem.initial_values, seed)
        for number, ridge in enumerate(RIDGES, 1):
            problem = dataclasses.replace(problem, ridge=ridge)
            _, ended_arm = problem.descend(search, SEARCH_OF_RESIDUAL, number)
            gain = ResidualGain(before, run_errors(ended_arm, held_back), far)
            trials.append((float(rms(gain.hybrid)[joint]), ended_arm, gain))
            progress(f"residual of joint {joint + 1}, ridge of {ridge:g}: {gain}")
        _, hybrid, gain = min(trials, key=lambda trial: (not trial[2].accepts(joint), trial[0]))
        if gain.accepts(joint):
            accepted_arm = hybrid
            accepted = [*accepted, joint + 1]
    return accepted_arm, accepted


def judged_residual(
    arm: PressureDriven,
    fitted: Episodes,
    judge: Windows,
    delay: int,
    seed: int,
    progress: Callable[[str], None],
) -> tuple[PressureDriven, ResidualGain, str]:
    """The arm with the residual that episodes held back confirm, or as it is; its gain on other
    windows; in words.
    """
    hybrid, joints = fit_residual(
        arm, fitted, delay=delay, rows=judge.rows, seed=seed, progress=progress
    )
    gain = ResidualGain(run_errors(arm, judge), run_errors(hybrid, judge), distance(hybrid, judge))
    if not joints:
        return (
            arm,
            gain,
            f"physics suffices: no residual gains {100 * GAIN:g} % on fitted episodes held back",
        )
    names = ", ".join(map(str, joints))
    rest = "" if len(joints) == judge.angle.shape[2] else "; for the other joints physics suffices"
    return (
        hybrid,
        gain,
        f"hybrid law, with a residual for joint {names}{rest}: on the episodes left out {gain}",
    )


def _gaussian_residual(
    arm: PressureDriven, episodes: Episodes, centres: int, seed: int
) -> GaussianResidual:
    """A residual without effect, whose centres are rows of the episodes and whose scales are their
    deviations.
    """
    rows = [episodes.rows(name) for name in ("angle", "pressure")]
    scales = [
        np.maximum(readings.std(axis=0), least)
        for readings, least in zip(rows, (1e-3, 1e3), strict=True)
    ]
    scaled = np.concatenate(
        [readings / scale for readings, scale in zip(rows, scales, strict=True)], axis=1
    )
    count = min(centres, len(scaled))
    joints = episodes.joints
    centre_rows = scaled[np.random.default_rng(seed).permutation(len(scaled))[:count]]
    return GaussianResidual(
        tuple(f"{prefix}pressure" for prefix in arm.prefixes),
        tuple(scales[0].tolist()),
        tuple(scales[1].tolist()),
        tuple(centre_rows.ravel().tolist()),
        (0.0,) * count,
        (0.0,) * (count * joints),
    )


def distance(arm: PressureDriven, windows: Windows) -> Array:
    """Distance (N,) of the episode of each window from the nearest centres, rms over rows and
    coordinates.
    """
    residual = cast(GaussianResidual, cast(WithStickSlip, arm.mechanism).residual)
    scales = np.array([*residual.angle_scales, *residual.pressure_scales])
    centres = np.array(residual.centres).reshape(-1, len(scales))
    rows = [windows.angle[:, HISTORY:], windows.pressure[:, HISTORY:]]
    scaled = np.concatenate(rows, axis=-1) / scales
    squares = [np.mean((scaled - centre) ** 2, axis=-1) for centre in centres]
    nearest = np.mean(np.min(squares, axis=0), axis=1)
    total = np.bincount(windows.episode, nearest)
    count = np.bincount(windows.episode)
    of_episodes = np.sqrt(total / np.maximum(count, 1))
    return np.asarray(of_episodes[windows.episode])
