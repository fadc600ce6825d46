"""Identification of an arm from episodes of pressures and angles, by multiple shooting of its free run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ...core import tree
from ...core.errors import ParameterError
from ...physics import PressureDriven
from .descent import Descent, SearchStage
from .episode_inspection import check_episodes, inspect_episodes
from .episodes import Episodes
from .free_run import band, baseline_errors, free_run, rms
from .reduced_arm import own_parameters, reduced_arm, shared_parameters, stronger
from .result import ArmFit
from .separation import separate
from .windows import HISTORY, ROWS, Windows, cut

STRENGTHS = (1.0, 6.0)
"""Ratios of force and inertia from which the search of each joint starts (chosen)."""
TRIALS = (SearchStage(12, 30, 120), SearchStage(40, 50, 120))
"""Short and then long windows of every trial (chosen)."""
SEARCH = SearchStage(40, 120, 160)
"""The search of each joint from its best trial (chosen)."""
CONTACT = 5.0
"""Ratio of the greatest error in an episode to the rms error from which a contact is suspected (chosen)."""

Progress = Callable[[str], None]


def fit_joint(
    episodes: Episodes,
    *,
    pairs: Sequence[tuple[int, int]] = (),
    axes: Sequence[tuple[int, int, int]] = (),
    left_out: float = 0.1,
    rows: int = ROWS,
    seed: int = 0,
    progress: Progress = lambda text: None,
) -> ArmFit:
    """Identify a joint, or an arm of joints, from episodes of pressures and angles.

    pairs     for each joint the muscles, from 1, that raise and lower its angle; found from the record unless given
    axes      axes of the joints in the frames of their links, (0, 0, 1) for z: the inertial coupling of the links is
              then identified; without them every joint has its own inertia
    left_out  share of the episodes, the last ones, on which the free run is judged
    rows      horizon of the free run
    progress  called with one line after each stage

    Forces are linear in pressure with polynomials of the angle (LinearInPressure), friction sticks and grows with the
    tensions (StickSlip), a lag of each muscle and a common delay of the sensors are found; zero and gain of a pressure
    are absorbed. The objective is the robust error of the free run over windows of 40 rows, with exact gradients.
    Raises IdentificationError for episodes that `inspect_episodes` refuses, ParameterError for impossible arguments.
    """
    if not 0.0 < left_out < 1.0 or len(episodes) < 4:
        raise ParameterError(
            f"fit_joint: left_out is {left_out:g} of {len(episodes)} episodes; give 4 episodes or more, and a share "
            "between 0 and 1."
        )
    inspection = inspect_episodes(episodes, pairs)
    check_episodes(inspection)
    found = tuple(pairs) or inspection.pairs
    if (axes and len(axes) != episodes.joints) or len(found) != episodes.joints:
        raise ParameterError(
            f"fit_joint: {len(found)} pairs and {len(axes)} axes are given for {episodes.joints} joints; give one each."
        )
    progress(f"delay of the pressures: {inspection.delay} rows")
    ordered = _ordered(episodes, found)
    split = max(1, round((1.0 - left_out) * len(ordered)))
    train, judge = cut(ordered[:split], inspection.delay, rows), cut(ordered[split:], inspection.delay, rows)
    arm, paths = _search(ordered[:split], train, tuple(axes), seed, progress)
    errors = free_run(arm, judge) - judge.angle[:, HISTORY + 1 :]
    others = baseline_errors(ordered[:split], ordered[split:], rows)
    separated = [separate(arm, joint, own, train) for joint, own in paths.items()]
    remarks = [
        *inspection.remarks,
        SCALE,
        *(text for _, texts in separated for text in texts),
        *_contacts(ordered, errors, judge, split),
    ]
    return ArmFit(
        arm, inspection, found, errors, judge.episode, others, band(errors),
        tuple({e.path: e for estimates, _ in separated for e in estimates}.values()), tuple(dict.fromkeys(remarks)),
    )  # fmt: skip


SCALE = (
    "pressures and angles do not contain the scale of the torques: the inertia of every joint is chosen, 0.1 kg m2; "
    "hang a known mass on the arm, or weigh its links, to fix it"
)


def _ordered(episodes: Episodes, pairs: Sequence[tuple[int, int]]) -> Episodes:
    """Episodes whose pressures stand in the order of the pairs."""
    order = [muscle - 1 for pair in pairs for muscle in pair]
    if min(order) < 0 or max(order) >= episodes.muscles or len(set(order)) < len(order):
        raise ParameterError(
            f"fit_joint: pairs are {tuple(pairs)}; there are pressures 1 to {episodes.muscles}, each in one pair."
        )
    runs = [dataclasses.replace(run, pressure=run.pressure[:, order]) for run in episodes.runs]
    return dataclasses.replace(episodes, runs=tuple(runs))


def _search(
    episodes: Episodes, windows: Windows, axes: tuple[tuple[int, int, int], ...], seed: int, progress: Progress
) -> tuple[PressureDriven, dict[int, list[str]]]:
    """The arm, and the parameters fitted for each joint; the most coupled joint determines what they share."""
    low, high = np.quantile(episodes.rows("angle"), (0.01, 0.99), axis=0)
    arm = reduced_arm(0.5 * (low + high), axes)
    shared = shared_parameters(axes) if axes else []
    prior = {leaf.path: float(leaf.value) for leaf in tree.leaves(arm) if leaf.path in shared}
    paths: dict[int, list[str]] = {}
    for joint in _by_coupling(axes, episodes.joints):
        paths[joint] = [*own_parameters(joint), *(shared if not paths else [])]
        trials = [
            _trial(Descent(stronger(arm, joint, factor), windows, {joint: paths[joint]}, seed, prior))
            for factor in STRENGTHS
        ]
        best = min(trials, key=lambda trial: trial[0])[1]
        cost = best.run(_shortened(SEARCH, best))
        arm = best.arm
        progress(f"joint {joint + 1}: {np.degrees(np.sqrt(cost)):.3g} deg, robust mean over the windows")
    return arm, dict(sorted(paths.items()))


def _by_coupling(axes: tuple[tuple[int, int, int], ...], joints: int) -> list[int]:
    """The joints, first the one with the most joints beyond it about a parallel axis, whose inertia acts on it."""
    parallel = [[abs(np.dot(a, b)) for b in axes[j + 1 :]] for j, a in enumerate(axes)] or [[]] * joints
    return sorted(range(joints), key=lambda joint: -sum(parallel[joint]))


def _trial(descent: Descent) -> tuple[float, Descent]:
    for schedule in TRIALS:
        cost = descent.run(_shortened(schedule, descent))
    return cost, descent


def _shortened(schedule: SearchStage, descent: Descent) -> SearchStage:
    return dataclasses.replace(schedule, rows=min(schedule.rows, descent.windows.rows))


def _contacts(episodes: Episodes, errors: np.ndarray, windows: Windows, split: int) -> list[str]:
    """Episodes left out with an error far beyond the others, in which the arm may have touched something."""
    worst = np.max(np.abs(errors) / rms(errors), axis=(1, 2))
    names = [episodes.runs[split + int(windows.episode[i])].name for i in np.argsort(-worst)[:3] if worst[i] > CONTACT]
    return [f"errors beyond {CONTACT:g} times the rms, by contact or friction: {', '.join(names)}"] if names else []
