"""Free run of an arm over windows: its baselines, and the residual that physics leaves in it."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import cast

import numpy as np

from ...core import Array, tree
from ...physics import GaussianResidual, PressureDriven, WithStickSlip
from ..baselines import ARX, DEPTH, PERSISTENCE, fit_arx
from .descent import Descent, SearchStage, with_slopes
from .episodes import HISTORY, ROWS, Episodes, Windows, cut, rms, start_of
from .pressures import without_saturated


def free_run(arm: PressureDriven, windows: Windows) -> Array:
    """Angles (N, rows, J) [rad] from the start of every window, which a run that fails keeps, and pressures alone."""
    found = angles(arm, windows.pressure[:, HISTORY:], start_of(arm, windows), windows.sample_time)[:, 1:]
    kept = windows.angle[:, HISTORY : HISTORY + 1]
    return np.where(np.isfinite(found) & (np.abs(found - kept) < 2 * np.pi), found, kept)


def run_errors(arm: PressureDriven, windows: Windows) -> Array:
    """Errors (N, rows, J) [rad] of the free run of all joints."""
    return free_run(arm, windows) - windows.angle[:, HISTORY + 1 :]


def free_errors(arm: PressureDriven, joint: int, windows: Windows) -> Array:
    """Errors (N, rows) [rad] of one joint in the free run of all joints."""
    return np.asarray(run_errors(arm, windows)[..., joint])


def angles(arm: PressureDriven, pressure: Array, start: Mapping[str, Array], sample_time: float) -> Array:
    """Angles (N, R, J) [rad] under the pressures (N, R, M) from states (N,)."""
    return with_slopes(arm, (), pressure, sample_time, start, [c.name for c in arm.mechanism.coordinates])[0]


# Baselines: persistence, and a linear ARX model of all joints

LIMIT = 9.0
"""Limit of an angle [rad], so that an unstable prediction ends in a large error and not in infinity."""


def baseline_errors(train: Episodes, judge: Episodes, rows: int) -> Mapping[str, Array]:
    """Errors (N, rows, J) [rad] of the free run of each baseline over the windows of `judge`, by its name."""
    windows, begin = cut(judge, 0, rows), HISTORY - DEPTH + 1
    arx = fit_arx([(run.angle, run.pressure) for run in train.runs if len(run) > DEPTH + 1], -LIMIT, LIMIT)
    predicted = arx.free_run(windows.angle[:, begin : HISTORY + 1], windows.pressure[:, begin:])
    by_name = {PERSISTENCE: windows.angle[:, HISTORY : HISTORY + 1], ARX: predicted}
    return {name: angle - windows.angle[:, HISTORY + 1 :] for name, angle in by_name.items()}


# Hybrid law: what physics leaves in the free run, fitted as a residual and judged on episodes held back

CENTRES = 100
"""Number of centres, rows of the fitted episodes drawn at random (chosen)."""
RIDGES = (50.0, 5.0)
"""Weights of the ridge towards no residual that are tried, the strongest first (chosen)."""
SEARCH_OF_RESIDUAL = SearchStage(40, 20, 240)
"""The search with each ridge, from the result of the one before (chosen)."""
HELD_BACK = 0.1
"""Share of the fitted episodes, the last ones, that chooses the ridge and the joints with a residual (chosen)."""
FAR, GAIN, LOSS = 0.05, 0.15, 0.05
"""Share of the windows, by the distance of their episodes, that counts as far from the data; gain and loss of a law
that is accepted."""


@dataclasses.dataclass(frozen=True, eq=False)
class ResidualGain:
    """Errors (N, rows, J) [rad] of the free run of physics alone and of the hybrid law over the same windows.

    distance (N,) of the episode of each window from the centres of the residual, relative to its scales.
    """

    physics: Array
    hybrid: Array
    distance: Array

    def change(self, far: bool) -> Array:
        """Relative change (J,) of the rms error by the residual, far from the data or near it."""
        which = (self.distance >= np.quantile(self.distance, 1.0 - FAR, method="lower")) == far
        return np.asarray(rms(self.hybrid[which]) / rms(self.physics[which]) - 1.0)

    def accepts(self, joint: int) -> bool:
        """Whether a joint gains GAIN near the data, loses LOSS at most far from it, and no other loses more."""
        near, far = self.change(far=False), self.change(far=True)
        return bool(near[joint] <= -GAIN and far[joint] <= LOSS and np.all(near <= LOSS))

    def __str__(self) -> str:
        near, far = (", ".join(f"{100 * c:+.0f}" for c in self.change(far)) for far in (False, True))
        return f"{near} % of the rms error of joints 1 to {self.hybrid.shape[2]} near the data, {far} % far from it"


def fit_residual(
    arm: PressureDriven, episodes: Episodes, *, delay: int = 0, rows: int = ROWS, centres: int = CENTRES, seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[PressureDriven, list[int]]:  # fmt: skip
    """The arm with a residual, joint after joint, and the joints (from 1) whose gain episodes held back confirm.

    arm      with stick-slip; its pressures are those of the episodes, in their order, `delay` rows later
    centres  number of the Gaussian functions

    Physics stays as it is. The ridge draws towards the residual of the joints before; of its weights that episodes held
    back confirm, the one with the smallest error of the joint there is taken. A residual without any joint is zero.
    """
    split = max(1, round((1.0 - HELD_BACK) * len(episodes)))
    every, held = cut(episodes[:split], delay, rows, stride=max(1, rows // 2)), cut(episodes[split:], delay, rows)
    train, _ = without_saturated(every, episodes)
    residual, accepted = _gaussian_residual(arm, episodes[:split], centres, seed), list[int]()
    hybrid_mechanism = dataclasses.replace(cast(WithStickSlip, arm.mechanism), residual=residual)
    found = dataclasses.replace(arm, mechanism=hybrid_mechanism)
    far = distance(found, held)
    for joint in range(episodes.joints):
        before, trials, count = run_errors(found, held), [], len(residual.energies)
        paths = [f"mechanism.residual.energies[{k}]" for k in range(count)]
        paths += [f"mechanism.residual.friction_logs[{joint * count + k}]" for k in range(count)]
        values = {leaf.path: float(leaf.value) for leaf in tree.leaves(found)}
        descent = Descent(found, train, joint, paths, seed, {path: values[path] for path in paths})
        for ridge in RIDGES:
            descent.ridge = ridge
            descent.run(SEARCH_OF_RESIDUAL)
            gain = ResidualGain(before, run_errors(descent.arm, held), far)
            trials.append((float(rms(gain.hybrid)[joint]), descent.arm, gain))
            progress(f"residual of joint {joint + 1}, ridge of {ridge:g}: {gain}")
        _, hybrid, gain = min(trials, key=lambda trial: (not trial[2].accepts(joint), trial[0]))
        if gain.accepts(joint):
            found, accepted = hybrid, [*accepted, joint + 1]
    return found, accepted


def judged_residual(
    arm: PressureDriven, fitted: Episodes, judge: Windows, delay: int, seed: int, progress: Callable[[str], None]
) -> tuple[PressureDriven, ResidualGain, str]:
    """The arm with the residual that episodes held back confirm, or as it is; its gain on other windows; in words."""
    hybrid, joints = fit_residual(arm, fitted, delay=delay, rows=judge.rows, seed=seed, progress=progress)
    gain = ResidualGain(run_errors(arm, judge), run_errors(hybrid, judge), distance(hybrid, judge))
    if not joints:
        return arm, gain, f"physics suffices: no residual gains {100 * GAIN:g} % on fitted episodes held back"
    names = ", ".join(map(str, joints))
    rest = "" if len(joints) == judge.angle.shape[2] else "; for the other joints physics suffices"
    return hybrid, gain, f"hybrid law, with a residual for joint {names}{rest}: on the episodes left out {gain}"


def _gaussian_residual(arm: PressureDriven, episodes: Episodes, centres: int, seed: int) -> GaussianResidual:
    """A residual without effect, whose centres are rows of the episodes and whose scales are their deviations."""
    rows = [episodes.rows(name) for name in ("angle", "pressure")]
    scales = [np.maximum(each.std(axis=0), least) for each, least in zip(rows, (1e-3, 1e3), strict=True)]
    scaled = np.concatenate([each / scale for each, scale in zip(rows, scales, strict=True)], axis=1)
    count, joints = min(centres, len(scaled)), episodes.joints
    some = scaled[np.random.default_rng(seed).permutation(len(scaled))[:count]]
    return GaussianResidual(
        tuple(f"{prefix}pressure" for prefix in arm.prefixes), tuple(scales[0].tolist()), tuple(scales[1].tolist()),
        tuple(some.ravel().tolist()), (0.0,) * count, (0.0,) * (count * joints),
    )  # fmt: skip


def distance(arm: PressureDriven, windows: Windows) -> Array:
    """Distance (N,) of the episode of each window from the nearest centres, rms over rows and coordinates."""
    residual = cast(GaussianResidual, cast(WithStickSlip, arm.mechanism).residual)
    scales = np.array([*residual.angle_scales, *residual.pressure_scales])
    centres = np.array(residual.centres).reshape(-1, len(scales))
    x = np.concatenate([windows.angle[:, HISTORY:], windows.pressure[:, HISTORY:]], axis=-1) / scales
    nearest = np.min([np.mean((x - centre) ** 2, axis=-1) for centre in centres], axis=0)
    total, count = (np.bincount(windows.episode, w) for w in (np.mean(nearest, axis=1), None))
    return np.asarray(np.sqrt(total / np.maximum(count, 1))[windows.episode])
