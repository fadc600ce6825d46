"""Identification of an arm from episodes of pressures and angles, by multiple shooting of its free
run.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from ...core import Array, ParameterError, one_thread, tree
from ...engine.distribution import DistributedCalls, stored_result
from ...engine.processes import Workers, process_pool, thread_pool
from ...physics import (
    Braid,
    Muscle,
    MuscleRoute,
    PressureDriven,
    SerialArm,
    SpatialLink,
    StickSlip,
    WithStickSlip,
)
from ...physics.muscle.characteristic.linear_in_pressure import LinearInPressure
from ..estimation import SearchStage
from .descent import (
    CLIP,
    DescentEnd,
    JointProblem,
    gradients,
    joint_errors,
    typical_size,
    with_values,
)
from .episode_inspection import checked_inspection, faults_of_judge, without_saturated
from .episodes import ROWS, Episodes, Windows, band, count_fitted, cut, in_pairs, long_enough, rms
from .free_run import (
    baseline_errors,
    fit_regulator_lags,
    free_errors,
    from_commands,
    judged_residual,
    run_errors,
)
from .result import ArmFit, ArmParameter

STRENGTHS = (1.0, 6.0)
"""Ratios of force and inertia from which the search of each joint starts (chosen)."""
STAGES = (SearchStage(12, 30, 120), SearchStage(40, 50, 120), SearchStage(40, 120, 160))
"""Short and then long windows of every search (chosen)."""
CONTACT = 5.0
"""Ratio of the greatest error in an episode to the rms error from which a contact is suspected
(chosen).
"""

Progress = Callable[[str], None]


@one_thread()
def fit_joint(
    episodes: Episodes,
    *,
    pairs: Sequence[tuple[int, int]] = (),
    axes: Sequence[tuple[int, int, int]] = (),
    left_out: float | None = None,
    rows: int = ROWS,
    residual: bool = False,
    seed: int = 0,
    progress: Progress = lambda text: None,
    workers: Workers = 1,
) -> ArmFit:
    """Identify a joint, or an arm of joints, from episodes of pressures and angles.

    pairs     for each joint the muscles, from 1, that raise and lower its angle; found from the
              fitted episodes unless given
    axes      axes of the joints in the frames of their links, (0, 0, 1) for z: the inertial
              coupling of the links is then identified; without them every joint has its own inertia
    left_out  share of the episodes, the last ones, on which the free run is judged, and which are
              used for nothing else; by default a tenth, or 19 episodes if that is more, but a third
              at most
    rows      horizon of the free run
    residual  whether a hybrid law is fitted to what physics leaves (GaussianResidual); a joint has
              one if it gains 15 % on fitted episodes held back, and loses at most 5 % on the 5 % of
              them farthest from the data
    progress  called with one line after each stage
    workers   number of processes, as in `compare`, for the searches of a joint; 1: threads of this
              process

    Forces are linear in pressure with polynomials of the angle (LinearInPressure), friction sticks
    and grows with the tensions, that of the last of coupled joints also with the load of its
    bearing (StickSlip); a lag of each muscle and a common delay of the sensors are found; zero and
    gain of a pressure are absorbed. Where episodes have commands, a regulator of each muscle is
    identified, too. The objective is the robust error of the free run over windows of 40 rows, with
    exact gradients. Raises IdentificationError for episodes that `inspect_episodes` refuses,
    ParameterError for impossible arguments.
    """
    episodes, short = long_enough(episodes, rows)
    split = count_fitted(episodes, left_out)
    inspection = checked_inspection(episodes[:split], tuple(pairs), rows)
    muscle_pairs = tuple(pairs) or inspection.pairs
    if (axes and len(axes) != episodes.joints) or len(muscle_pairs) != episodes.joints:
        raise ParameterError(
            f"fit_joint: {len(muscle_pairs)} pairs and {len(axes)} axes are given for"
            f" {episodes.joints} joints; give one each."
        )
    progress(f"delay of the pressures: {inspection.delay} rows")
    ordered = in_pairs(episodes, muscle_pairs)
    fitted = ordered[:split]
    left = ordered[split:]
    delay = inspection.delay
    judge = cut(left, delay, rows)
    train, clipped = without_saturated(cut(fitted, delay, rows), fitted)
    with thread_pool(len(STRENGTHS)) if workers == 1 else process_pool(workers) as executor:
        arm, paths = _search(fitted, train, tuple(axes), seed, progress, executor)
    of_joints = [separate(arm, joint, joint_paths, train) for joint, joint_paths in paths.items()]
    sampled = train.sample(WINDOWS)
    solved = tuple(
        JointProblem(arm, sampled, joint, tuple(joint_paths)).solved
        for joint, joint_paths in paths.items()
    )
    gain = None
    remarks = [*short, *inspection.remarks, *faults_of_judge(episodes[split:]), *clipped, SCALE]
    for of_joint in of_joints:
        remarks += of_joint.remarks
    if residual:
        physics = arm
        arm, gain, words = stored_result(
            f"{__name__}:residual",
            (physics, fitted, judge, delay, seed),
            lambda: judged_residual(physics, fitted, judge, delay, seed, progress),
        )
        remarks.append(words)
    errors = run_errors(arm, judge)
    regulators = fit_regulator_lags(fitted, rows)
    commanded, unlike = (
        from_commands(regulators, left, delay, rows, muscle_pairs) if regulators else (None, [])
    )
    remarks += _contacts(ordered, errors, judge, split) + unlike
    return ArmFit(
        arm,
        inspection,
        muscle_pairs,
        errors,
        judge.episode,
        baseline_errors(fitted, left, rows),
        band(errors),
        tuple(estimate for of_joint in of_joints for estimate in of_joint.estimates),
        tuple(dict.fromkeys(remarks)),
        split,
        regulators,
        None if commanded is None else run_errors(arm, commanded),
        block_diag(*(of_joint.covariance for of_joint in of_joints)),
        gain,
        solved=solved,
    )


SCALE = (
    "pressures and angles do not contain the scale of the torques: the inertia of every joint is"
    " chosen, 0.1 kg m2; hang a known mass on the arm, or weigh its links, to fix it"
)


def _search(
    episodes: Episodes,
    windows: Windows,
    axes: tuple[tuple[int, int, int], ...],
    seed: int,
    progress: Progress,
    executor: Executor | None,
) -> tuple[PressureDriven, dict[int, list[str]]]:
    """The arm, and the parameters fitted for each joint; the most coupled joint determines what
    they share.
    """
    low, high = np.quantile(episodes.rows("angle"), (0.01, 0.99), axis=0)
    level = float(np.quantile(np.abs(episodes.rows("pressure")), 0.99))
    arm = reduced_arm(0.5 * (low + high), axes, LEVEL if LEVEL / 10 < level < 10 * LEVEL else level)
    shared = shared_parameters(axes) if axes else []
    prior = {leaf.path: float(leaf.value) for leaf in tree.leaves(arm) if leaf.path in shared}
    paths: dict[int, list[str]] = {}
    # first the joint with the most joints beyond it about a parallel axis, whose inertia acts on it
    coupling = [sum(abs(np.dot(a, b)) for b in axes[j + 1 :]) for j, a in enumerate(axes)] or [
        0.0
    ] * episodes.joints
    for joint in sorted(range(episodes.joints), key=lambda joint: -coupling[joint]):
        paths[joint] = [*own_parameters(arm, joint), *(shared if not paths else [])]
        judge = (
            free_errors if len(paths) == episodes.joints else joint_errors
        )  # all others are identified
        starts = [stronger(arm, joint, factor) for factor in STRENGTHS]
        searches = [
            JointProblem(start, windows, joint, tuple(paths[joint]), seed, prior, errors=judge)
            for start in starts
        ]
        cost, arm = _best(searches, executor)
        progress(
            f"joint {joint + 1}: {np.degrees(np.sqrt(cost)):.3g} deg, robust mean over the windows"
        )
    return arm, dict(sorted(paths.items()))


def _best(searches: Sequence[JointProblem], executor: Executor | None) -> DescentEnd:
    """The end with the smallest cost of searches that the executor runs in parallel."""
    ends: list[DescentEnd] = DistributedCalls(executor, _search_to_end, None).results(searches)
    return min(ends, key=lambda end: end.cost)


def _search_to_end(_: None, search: JointProblem) -> DescentEnd:
    return search.search(STAGES)


def _contacts(episodes: Episodes, errors: np.ndarray, windows: Windows, split: int) -> list[str]:
    """Episodes left out with an error far beyond the others, in which the arm may have touched
    something.
    """
    worst = np.max(np.abs(errors) / rms(errors), axis=(1, 2))
    names = [
        episodes.runs[split + int(windows.episode[i])].name
        for i in np.argsort(-worst)[:3]
        if worst[i] > CONTACT
    ]
    return (
        [f"errors beyond {CONTACT:g} times the rms, by contact or friction: {', '.join(names)}"]
        if names
        else []
    )


# Separation of the parameters by a record: standard errors of the estimates, and directions that
# have no value

UNSEPARATED = 1.0
SHARE = 0.1
NAMED = 6
WINDOWS = 300
"""Standard error of a direction, relative to its parameters, from which it is not separated; share
of a parameter in such directions that is named, and number of names; windows from which the
information is computed (chosen)."""
WORDS = {
    "area": "effective area",
    "passive_force": "force without pressure",
    "slack_width": "width of slackening",
    "lags": "lag of the pressure",
    "coulomb_torque": "dry friction",
    "presliding_angle": "presliding angle",
    "load_arms": "growth of friction with tension",
    "bearing_arms": "growth of friction with the load of the bearing",
    "static_excess": "stiction",
    "stribeck_speed": "Stribeck speed",
    "damping": "viscous friction",
    "rotor_inertia": "inertia",
    "inertia": "inertia of a link",
    "mass": "mass of a link",
    "centre": "centre of mass",
    "zero_angle": "direction of gravity",
}


class SeparatedEstimates(NamedTuple):
    """Estimates, their covariance (P, P) along what a record separates, and remarks on what it does
    not separate.
    """

    estimates: list[ArmParameter]
    covariance: Array
    remarks: list[str]


class Separation(NamedTuple):
    """Estimates, their covariance (P, P) along what a record separates, and the share (P,) of each
    in the directions that it does not separate.
    """

    estimates: list[ArmParameter]
    covariance: Array
    shares: Array


def separate(
    arm: PressureDriven, joint: int, paths: Sequence[str], windows: Windows
) -> SeparatedEstimates:
    """Estimates of one joint from the Fisher information."""
    sampled = windows.sample(WINDOWS)
    leaves = {leaf.path: leaf for leaf in tree.leaves(arm)}
    values = np.array([float(leaves[path].value) for path in paths])
    sizes = np.maximum(np.abs(values), [typical_size(path, leaves) for path in paths])
    error, gradient = gradients(arm, joint, paths, sampled)
    scaled = gradient * sizes
    weight = 1.0 / np.sqrt(1.0 + (error / CLIP) ** 2)
    scale = np.sqrt(np.mean(error**2) * windows.rows)  # the errors of one window count as one
    of_sample = np.einsum("nrp,nr,nrq->pq", scaled, weight, scaled)
    information = of_sample * (len(windows) / len(sampled)) / max(scale, 1e-9) ** 2
    separation = separated(information, paths, values, sizes)
    names = [_name(path) for path in paths]
    remarks = not_separated(f"joint {joint + 1}: ", names, separation.shares)
    return SeparatedEstimates(separation.estimates, separation.covariance, remarks)


def separated(information: Array, paths: Sequence[str], values: Array, sizes: Array) -> Separation:
    """Estimates by the Fisher information (P, P) of parameters over their sizes (P,)."""
    levels, directions = np.linalg.eigh(information)
    weak = levels < 1.0 / UNSEPARATED**2
    inverse = sizes[:, None] * directions / np.sqrt(np.maximum(levels, 1e-12 * levels[-1]))
    errors = np.sqrt(np.sum(inverse**2, axis=1))
    rows = zip(paths, values.tolist(), errors.tolist(), strict=True)
    known = inverse[:, ~weak]
    shares = np.sum(directions[:, weak] ** 2, axis=1)
    return Separation([ArmParameter(*row) for row in rows], known @ known.T, shares)


def not_separated(where: str, names: Sequence[str], shares: Array) -> list[str]:
    """The parameters of the directions that are not separated, first those that have the least
    information.
    """
    weak = list(dict.fromkeys(names[i] for i in np.argsort(-shares) if shares[i] > SHARE))
    further = f" and {len(weak) - NAMED} more" if len(weak) > NAMED else ""
    text = (
        f"{where}the record does not separate {', '.join(weak[:NAMED])}{further}: combinations of"
        " them may have any value; fix or measure them before they are read as properties of"
        " the arm"
    )
    return [text] if weak else []


def _name(path: str) -> str:
    field = path.rsplit(".", 1)[-1]
    muscle = (
        path.split("]", maxsplit=1)[0].removeprefix("muscle[") if path.startswith("muscle[") else ""
    )
    word = WORDS[field.split("[", maxsplit=1)[0]]
    if muscle:
        return f"{word} of muscle {int(muscle) + 1}" + (
            f" (degree {field[-2]})" if field.endswith("]") else ""
        )
    if field.startswith(("lags", "load_arms")):
        return f"{word} of muscle {int(field.split('[')[1][:-1]) + 1}"
    return word


# Reduced arm of unknown size from which a fit starts: muscles linear in pressure on links with
# stick-slip

RADIUS = 0.03
LENGTH = 0.3
INERTIA = 0.1
AREA = 6.7e-4
FIBRE_ANGLE = 0.65
"""Moment arm [m], resting length and distance of joints [m], inertia [kg m^2] and area [m2] of
every joint, chosen: a record of pressures and angles contains none of the first three, and each
multiplies coefficients that are fitted. The fibre angle [rad] of the volume permits 2.5 rad to both
sides."""
LEVEL = 3e5
"""Gauge pressure [Pa] at which a muscle pulls with this area (chosen), as far as the readings are
Pa and not counts.
"""


def reduced_arm(
    middle: Array, axes: Sequence[tuple[int, int, int]] = (), level: float = LEVEL
) -> PressureDriven:
    """Arm of J joints with a pair of muscles each, from which a fit starts: forces are polynomials
    about the middle of the range of each joint [rad], `level` is the reading of a high pressure, at
    which every muscle has the same force; without the axes, by which the coupling of the links is
    found, every joint has an inertia of its own.
    """
    count = len(middle)
    full = LEVEL * AREA
    sides = [(j, sign) for j in range(count) for sign in (1.0, -1.0)]
    routes = tuple(MuscleRoute((j + 1,), (sign * RADIUS,)) for j, sign in sides)
    area = (AREA * (LEVEL / level), 0.0, 0.0)
    passive = (-0.05 * full, 0.0, 0.0)
    laws = [
        LinearInPressure(area, passive, 0.3 * full, sign * RADIUS * float(middle[j]) / LENGTH)
        for j, sign in sides
    ]
    muscles = tuple(
        Muscle(law, Braid(0.01, FIBRE_ANGLE, LENGTH), name=f"m{i}") for i, law in enumerate(laws)
    )
    links = [
        SpatialLink(axes[0] if axes else (0, 0, 1), rotor_inertia=INERTIA, damping=0.5)
    ] * count
    for j in range(1, count) if axes else ():
        position = (LENGTH if j > 1 else 0.0, 0.0, 0.0)
        links[j] = SpatialLink(axes[j], position, 1.0, (0.0, 0.0, 0.0), 0.0, INERTIA, 0.5)
    loads = 0.1 * RADIUS * np.kron(np.eye(count), np.ones(2))
    *inner, last = (StickSlip(0.5, tuple(row.tolist()), presliding_angle=4e-3) for row in loads)
    elements = (*inner, replace(last, bearing_arms=(0.0,) if axes else ()))
    return PressureDriven(
        muscles, WithStickSlip(SerialArm(tuple(links), routes), elements), (0.02,) * (2 * count)
    )


def stronger(arm: PressureDriven, joint: int, factor: float) -> PressureDriven:
    """The arm with forces, dry friction and damping of one joint multiplied: another initial guess
    of its inertia.
    """
    fields = ("area", "passive_force", "slack_width", "coulomb_torque", "damping")
    strength_paths = [
        path for path in own_parameters(arm, joint) if path.rsplit(".")[-1].startswith(fields)
    ]
    values = {leaf.path: float(leaf.value) for leaf in tree.leaves(arm)}
    return with_values(arm, strength_paths, [factor * values[path] for path in strength_paths])


def own_parameters(arm: PressureDriven, joint: int) -> list[str]:
    """Paths of what a fit changes for one joint and its pair of muscles, in an arm of
    `reduced_arm`.
    """
    pair = (2 * joint, 2 * joint + 1)
    laws = [f"muscle[{m}].contractile." for m in pair]
    paths = [
        f"{law}{name}[{k}]" for law in laws for name in ("area", "passive_force") for k in range(3)
    ]
    paths += [f"{law}slack_width" for law in laws] + [f"lags[{m}]" for m in pair]
    element = f"mechanism.elements[{joint}]."
    link = f"mechanism.inner.links[{joint}]."
    paths += [f"{element}{name}" for name in ("coulomb_torque", "presliding_angle")]
    paths += [f"{element}load_arms[{m}]" for m in pair]
    paths += [
        leaf.path for leaf in tree.leaves(arm) if leaf.path.startswith(f"{element}bearing_arms")
    ]
    return [*paths, f"{element}static_excess", f"{element}stribeck_speed", f"{link}damping"]


def shared_parameters(axes: Sequence[tuple[int, int, int]]) -> list[str]:
    """Paths of what couples the joints of an arm of these axes, along which the place of a mass has
    no effect.
    """
    links = [f"mechanism.inner.links[{j}]." for j in range(len(axes))]
    outer = links[1:]
    paths = [f"{outer[0]}zero_angle"]
    paths += [f"{link}rotor_inertia" for link in outer]
    for link, axis in zip(outer, axes[1:], strict=True):
        paths += [f"{link}mass", f"{link}inertia"]
        paths += [f"{link}centre[{k}]" for k in range(3) if not axis[k]]
    return paths
