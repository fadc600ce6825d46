"""Signs of routes: the direction in which a route pulls a joint, against its name, its antagonist
and its twin on the other side of the body.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array, InputError
from .body import Body
from .kinematics import BodyKinematics, Poses
from .sweep import RouteSweep

SIDES = {"l": "left", "left": "left", "r": "right", "right": "right"}
FUNCTIONS = {
    **dict.fromkeys(("flx", "flex", "flexor", "flexion"), "flexion"),
    **dict.fromkeys(("ext", "extend", "extensor", "extension"), "extension"),
    **dict.fromkeys(("abd", "abductor", "abduction"), "abduction"),
    **dict.fromkeys(("add", "adductor", "adduction"), "adduction"),
    **dict.fromkeys(("pro", "pronator", "pronation"), "pronation"),
    **dict.fromkeys(("sup", "supinator", "supination"), "supination"),
}
"""Words of names, with the function of the muscle or the positive direction of the joint."""
OPPOSITES = {
    "flexion": "extension",
    "extension": "flexion",
    "abduction": "adduction",
    "adduction": "abduction",
    "pronation": "supination",
    "supination": "pronation",
}
ONE_SIDED = ("knee", "elbow")
"""Words of joints that bend to one side only: extension is towards the straight pose, 0."""
STRAIGHT = 0.1
"""Part of the range by which a one-sided joint may be bent beyond 0 (chosen)."""
MIRRORED = 0.7
"""Least cosine of the angle between the axis of a joint and the mirrored one of its twin
(chosen)."""


class RouteName(NamedTuple):
    """Parts of the name of a route or joint: side, function and the other words."""

    side: str
    function: str
    words: tuple[str, ...]


class WrongSign(NamedTuple):
    """A route that pulls against its name: the joint, its least and greatest moment arm [m or 1],
    and the contradiction in words.
    """

    route: str
    joint: str
    arms: tuple[float, float]
    reason: str


def parts_of_name(name: str) -> RouteName:
    """Side, function and other words of a name such as hip_L_flx or kneeExtensorRight."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    side = ""
    function = ""
    words = []
    for word in re.split(r"[^A-Za-z0-9]+|\s+", spaced):
        lower = word.lower()
        if lower in SIDES and not side:
            side = SIDES[lower]
        elif lower in FUNCTIONS and not function:
            function = FUNCTIONS[lower]
        elif lower:
            words.append(lower)
    return RouteName(side, function, tuple(words))


def read_direction(text: str, where: str) -> tuple[str, str]:
    """Joint and function of a text such as "knee_R=extension". Raises InputError."""
    joint, separator, word = text.partition("=")
    function = FUNCTIONS.get(word.strip().lower())
    if not separator or function is None:
        raise InputError(
            f"{where} is '{text}'; give a joint and the direction of its positive positions:"
            f" 'knee_R=extension'; directions: {', '.join(OPPOSITES)}."
        )
    return joint.strip(), function


def main_joint(sweep: RouteSweep) -> str | None:
    """The joint that a route is named for, or that moves it most; None without joints."""
    joints = sweep.route.joints
    if not joints:
        return None
    words = set(parts_of_name(sweep.route.name).words)
    named = [joint for joint in joints if words & set(parts_of_name(joint).words)]
    if len(named) == 1:
        return named[0]
    return joints[int(np.argmax(sweep.shares))]


def direction(sweep: RouteSweep, joint: str) -> int:
    """1 or -1 if a route pulls a joint towards greater or lesser positions in all poses, else 0."""
    low, high = sweep.arm_range(joint)
    return 1 if low > 0.0 else -1 if high < 0.0 else 0


def wrong_signs(
    body: Body, sweeps: Sequence[RouteSweep], positive: Mapping[str, str]
) -> list[WrongSign]:
    """The routes whose sign contradicts their name, or that of their antagonist or twin.

    positive  function of the positive direction of joints, by name, in addition to those that their
              names state
    """
    by_name = list(_against_names(body, sweeps, positive))
    named = {(wrong.route, wrong.joint) for wrong in by_name}
    pairs = [*_against_antagonists(sweeps), *_against_twins(body, sweeps)]
    return by_name + [wrong for wrong in pairs if (wrong.route, wrong.joint) not in named]


def _against_names(
    body: Body, sweeps: Sequence[RouteSweep], positive: Mapping[str, str]
) -> Iterator[WrongSign]:
    """Routes that pull against the function that their name states."""
    for sweep in sweeps:
        joint = main_joint(sweep)
        function = parts_of_name(sweep.route.name).function
        if joint is None or not function:
            continue
        stated, source = _positive_direction(body, joint, positive)
        sign = direction(sweep, joint)
        if not stated or function not in (stated, OPPOSITES[stated]) or sign == 0:
            continue
        pulls = stated if sign > 0 else OPPOSITES[stated]
        if pulls != function:
            yield WrongSign(
                sweep.route.name,
                joint,
                sweep.arm_range(joint),
                f"its name says {function}, and it pulls {joint} towards {pulls} ({source})",
            )


def _positive_direction(body: Body, joint: str, positive: Mapping[str, str]) -> tuple[str, str]:
    """Function of the positive direction of a joint, empty if not known, and its source."""
    if joint in positive:
        return positive[joint], "as stated"
    parts = parts_of_name(joint)
    if parts.function:
        return parts.function, f"the name of the joint says that positive is {parts.function}"
    ranges = body.joints[joint]
    if not set(parts.words) & set(ONE_SIDED) or not ranges.is_limited:
        return "", ""
    source = "extension is towards the straight pose, 0"
    if -ranges.low <= STRAIGHT * (ranges.high - ranges.low) and ranges.high > 0.0:
        return "flexion", source
    if ranges.high <= STRAIGHT * (ranges.high - ranges.low) and ranges.low < 0.0:
        return "extension", source
    return "", ""


def _against_antagonists(sweeps: Iterable[RouteSweep]) -> Iterator[WrongSign]:
    """Pairs of routes of one joint with opposite functions that pull in the same direction."""
    first_of: dict[tuple[str, tuple[str, ...], str], RouteSweep] = {}
    for sweep in sweeps:
        joint = main_joint(sweep)
        parts = parts_of_name(sweep.route.name)
        if joint is None or not parts.function:
            continue
        opposite = (parts.side, parts.words, OPPOSITES[parts.function])
        first_of.setdefault((parts.side, parts.words, parts.function), sweep)
        antagonist = first_of.get(opposite)
        if antagonist is None or joint not in antagonist.route.joints:
            continue
        sign = direction(sweep, joint)
        if sign != 0 and sign == direction(antagonist, joint):
            yield WrongSign(
                sweep.route.name,
                joint,
                sweep.arm_range(joint),
                f"it pulls {joint} in the same direction as its antagonist {antagonist.route.name}",
            )


def _against_twins(body: Body, sweeps: Sequence[RouteSweep]) -> Iterator[WrongSign]:
    """Routes that pull in the direction opposite to that of their twin on the other side."""
    axes = _axes(body)
    left: dict[tuple[tuple[str, ...], str], RouteSweep] = {}
    for sweep in sweeps:
        parts = parts_of_name(sweep.route.name)
        if parts.side == "left":
            left[parts.words, parts.function] = sweep
    for sweep in sweeps:
        parts = parts_of_name(sweep.route.name)
        twin = left.get((parts.words, parts.function)) if parts.side == "right" else None
        joint = main_joint(sweep)
        twin_joint = main_joint(twin) if twin is not None else None
        if twin is None or joint is None or twin_joint is None:
            continue
        same = _same_motion(axes, joint, twin_joint)
        signs = direction(sweep, joint) * direction(twin, twin_joint) * same
        if signs >= 0:
            continue
        low, high = twin.arm_range(twin_joint)
        yield WrongSign(
            sweep.route.name,
            joint,
            sweep.arm_range(joint),
            f"its twin {twin.route.name} pulls {twin_joint} in the mirrored opposite direction"
            f" (moment arm {shown_arms(body, twin_joint, (low, high))}): one of the names is wrong",
        )


def _axes(body: Body) -> Mapping[str, tuple[Array, Array]]:
    """Axis and anchor of each joint in the world, in the reference pose."""
    kinematics = BodyKinematics(body)
    kinematics.place(kinematics.rows(Poses((), np.zeros((1, 0))))[0])
    data = kinematics.data
    axes = {}
    for index in range(body.model.njnt):
        name = body.model.joint(index).name or f"joint{index}"
        axes[name] = np.array(data.xaxis[index]), np.array(data.xanchor[index])
    return axes


def _same_motion(axes: Mapping[str, tuple[Array, Array]], joint: str, twin: str) -> int:
    """1 if positive rotations of two joints are mirror images, -1 if one is to be reversed, 0 if
    the joints are no mirror images. The plane of symmetry is normal to the line between them.
    """
    axis, anchor = axes[joint]
    twin_axis, twin_anchor = axes[twin]
    normal = anchor - twin_anchor
    distance = float(np.linalg.norm(normal))
    if distance < 1e-3 or joint == twin:
        return 0
    normal = normal / distance
    # a rotation about an axis is mirrored into one about the negative of the mirrored axis
    mirrored = 2.0 * float(twin_axis @ normal) * normal - twin_axis
    cosine = float(axis @ mirrored)
    return 0 if abs(cosine) < MIRRORED else 1 if cosine > 0.0 else -1


def shown_arms(body: Body, joint: str, arms: tuple[float, float]) -> str:
    """A range of moment arms as text."""
    if body.joints[joint].is_hinge:
        return f"{1e3 * arms[0]:.4g} to {1e3 * arms[1]:.4g} mm"
    return f"{arms[0]:.4g} to {arms[1]:.4g}"
