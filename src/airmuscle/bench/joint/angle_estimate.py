"""AngleEstimate: the angles of an arm from its pressures alone, by free runs from the poses in
which episodes begin.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from ...core import Array, ParameterError, ShortRepr
from ...physics import PressureDriven
from .episodes import COVERAGE, Episode, Episodes
from .free_run import angles
from .identified import identified_arm
from .result import ArmFit

MEMBERS = 12
CALIBRATED = 800
EARLIER = 10
"""Poses from which every episode is run, episodes of the fit whose errors make correction and band,
and rows before a row whose pressures the correction sees, too (chosen)."""
UNSEEN = 0.5
"""Spread of the runs, relative to that of their poses, above which the pressures do not determine
an angle (chosen).
"""
RIDGE = 0.3
FEWEST = 10
BLOCKS = 4
"""Weight of the ridge relative to the number of episodes, least number of episodes in a row, and
number of blocks of episodes that are left out in turn for the band (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AngleEstimate(ShortRepr):
    """Angles of episodes from their pressures; N episodes of at most R rows, NaN after their ends;
    `print` it.

    angle     (N, R, J) [rad] mean of the runs from all poses, corrected
    spread    (N, R, J) [rad] standard deviation of these runs: large where the joint has not moved
              since the start
    band      (R, J) [rad] half-width that holds 95 % of the errors of the fitted episodes at this
              row
    measured  (N, R, J) [rad]; `range` (J,) [rad] of the fitted angles between their 1 and 99 %
              quantiles
    unseen    (J,) share of the rows where pressures alone do not determine the angle: motion is
              needed to see it
    """

    angle: Array
    spread: Array
    band: Array
    measured: Array
    range: Array
    unseen: Array

    @property
    def rms(self) -> Array:
        """Root mean square error (J,) [rad]."""
        return np.asarray(np.sqrt(np.nanmean((self.angle - self.measured) ** 2, axis=(0, 1))))

    @property
    def coverage(self) -> Array:
        """Share (J,) of the rows inside the band."""
        inside = (
            np.abs(self.angle - self.measured) <= self.band
        )  # false after the end of an episode
        return np.asarray(inside.sum(axis=(0, 1)) / np.isfinite(self.measured).sum(axis=(0, 1)))

    def __str__(self) -> str:
        joints = zip(
            itertools.count(1), self.rms, self.range, self.coverage, self.unseen, strict=False
        )
        return "\n".join(
            f"joint {j}: {np.degrees(error):.3g} deg rms from pressures alone,"
            f" {100 * error / span:.3g} % of its range, {100 * inside:.3g} % inside the 95 % band;"
            f" in {100 * unseen:.3g} % of the rows the angle is not seen until the joint moves"
            for j, error, span, inside, unseen in joints
        )


def estimate_angles(
    fit: ArmFit, episodes: Episodes, *, any_pose: bool = False, seed: int = 0
) -> AngleEstimate:
    """Angles and bands of episodes that are known by their pressures only.

    The identified arm runs freely from each of 12 poses. These are first rows of the fitted
    episodes, because an arm begins in a place that is known from them; with `any_pose` they are
    rows anywhere in these episodes. What differs between the runs is what the pressures do not
    tell: an angle that stiction holds is not seen until it moves. Speeds at the start are 0;
    readings count until the delay of their sensors after each row. The mean of the runs is
    corrected by what it lacked in fitted episodes: ridge regressions of every row on the angles so
    found and on the pressures; the band holds the errors of a quarter of these episodes with the
    regressions of the others. The measured angles serve only for `rms` and `coverage`. Raises
    ParameterError for other numbers of joints and muscles than those of the fit.
    """
    if episodes.muscles != len(fit.arm.muscle) or episodes.joints != len(fit.pairs):
        raise ParameterError(
            f"estimate_angles: the episodes have {episodes.joints} joints and {episodes.muscles}"
            f" pressures, the fit {len(fit.pairs)} and {len(fit.arm.muscle)}; give episodes of the"
            " same arm."
        )
    identified = identified_arm(fit)
    fitted = identified.acting(fit.inspection.episodes[: fit.fitted])
    rng = np.random.default_rng(seed)
    rows = fitted.rows("angle") if any_pose else np.array([run.angle[0] for run in fitted.runs])
    poses = rows[rng.choice(len(rows), min(MEMBERS, len(rows)), replace=False)]
    known = fitted[-CALIBRATED:]
    ordered = identified.acting(episodes)
    before, _ = _runs(fit.arm, known.runs, known.sample_time, fit.inspection.delay, poses)
    seen = _seen(before, known.runs)
    errors = before - _padded(known.runs, "angle")
    block = (
        np.arange(len(known)) * BLOCKS // len(known)
    )  # in time, so that a drift of the arm widens the band
    parts = [(block == b, block != b) for b in range(BLOCKS)]
    left = [
        errors[out] - _predicted_errors(seen[rest], errors[rest], seen[out]) for out, rest in parts
    ]
    level = min(
        1.0, COVERAGE * (1 + 1 / len(known))
    )  # so that it holds for one further episode, too
    limits = np.nanquantile(np.abs(np.concatenate(left)), level, axis=0, method="higher")
    angle, spread = _runs(fit.arm, ordered.runs, ordered.sample_time, fit.inspection.delay, poses)
    angle = angle - _predicted_errors(seen, errors, _seen(angle, ordered.runs))
    measured = _padded(ordered.runs, "angle")
    limits = limits[np.minimum(np.arange(angle.shape[1]), len(limits) - 1)]
    unseen = np.where(np.isfinite(measured), spread > UNSEEN * poses.std(axis=0), np.nan)
    span = np.ptp(np.quantile(fitted.rows("angle"), (0.01, 0.99), axis=0), axis=0)
    return AngleEstimate(angle, spread, limits, measured, span, np.nanmean(unseen, axis=(0, 1)))


def _predicted_errors(seen: Array, errors: Array, further: Array) -> Array:
    """Errors (N', R', J) of further episodes by ridge regressions of errors (N, R, J), one for each
    row, on what is `seen` (N, R, F) there; rows that fewer than FEWEST episodes reach have the
    regression of the row before.
    """
    enough = np.isfinite(errors).all(axis=2).sum(axis=0) >= FEWEST
    last = max(int(np.count_nonzero(enough)) - 1, 0)
    predicted = np.zeros((len(further), further.shape[1], errors.shape[2]))
    for row in range(further.shape[1]) if enough.any() else ():
        k = min(row, last)
        there = np.isfinite(errors[:, k]).all(axis=1)
        x = seen[there, k]
        e = errors[there, k]
        mean = x.mean(axis=0)
        scale = x.std(axis=0) + 1e-9
        z = (x - mean) / scale
        level = e.mean(axis=0)
        ridge = RIDGE * len(z) * np.eye(z.shape[1])
        slope = np.linalg.solve(z.T @ z + ridge, z.T @ (e - level))
        predicted[:, row] = level + (further[:, row] - mean) / scale @ slope
    return predicted


def _seen(angle: Array, runs: Sequence[Episode]) -> Array:
    """What a correction sees in every row (N, R, F): angles of the runs, pressures of the row and
    of an earlier one.
    """
    pressure = _padded(runs, "pressure", hold_last=True)
    earlier = np.maximum(np.arange(pressure.shape[1]) - EARLIER, 0)
    return np.concatenate([angle, pressure, pressure[:, earlier]], axis=-1)


def _runs(
    arm: PressureDriven, runs: Sequence[Episode], sample_time: float, delay: int, poses: Array
) -> tuple[Array, Array]:
    """Mean and standard deviation (N, R, J) of the free runs from all poses; NaN after the end of
    an episode.
    """
    pressure = _padded(runs, "pressure", hold_last=True)
    rows = pressure.shape[1]
    names = [c.name for c in arm.mechanism.coordinates]
    later = np.minimum(np.arange(rows) + delay, rows - 1)
    # every episode from every pose: the poses vary fastest
    commands = np.repeat(pressure[:, later], len(poses), axis=0)
    state = {s.name: np.zeros(len(commands)) for s in arm.states}
    for j, name in enumerate(names):
        state[name] = np.tile(poses[:, j], len(runs))
    for i, prefix in enumerate(arm.prefixes):
        state[f"{prefix}pressure"] = commands[:, 0, i]
    simulated = angles(arm, commands, state, sample_time)
    stacked = simulated.reshape(len(runs), len(poses), rows, len(names))
    ended = np.isnan(_padded(runs, "angle"))
    mean = np.where(ended, np.nan, stacked.mean(axis=1))
    deviation = np.where(ended, np.nan, stacked.std(axis=1))
    return mean, deviation


def _padded(runs: Sequence[Episode], name: str, hold_last: bool = False) -> Array:
    """One quantity of all episodes (N, R, columns), its last row held or NaN after the end of an
    episode.
    """
    columns = [getattr(run, name) for run in runs]
    longest = max(map(len, columns))
    padded = []
    for column in columns:
        end = column[-1:] if hold_last else np.full_like(column[-1:], np.nan)
        padded.append(np.concatenate([column, np.repeat(end, longest - len(column), axis=0)]))
    return np.stack(padded)
