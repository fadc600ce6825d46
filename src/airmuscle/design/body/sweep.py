"""Sweep of routes over the ranges of their joints: least and greatest lengths, moment arms, and
jumps of wrapping.
"""

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ShortRepr
from .body import WRAPS, Body, BodyRoute
from .kinematics import BodyKinematics, Poses, RouteSamples
from .poses import swept_poses

STARTS_OF_GRID = 2
STARTS_OF_SOBOL = 8
"""Numbers of the best sampled poses from which an extreme length is refined (chosen)."""
JUMP = 2e-3
"""Difference [m] between a change of length and the integral of the moment arm from which on the
length is said to jump (chosen)."""
NEIGHBOURHOOD = 1e-3
NEIGHBOURS = 12
"""Part of the ranges within which the neighbours of a pose are drawn, and their number (chosen): a
length that differs from theirs is that of an isolated pose, at which MuJoCo adds a turn around a
geom that the path only touches."""
LINE_POINTS = 401
"""Poses of a line over the range of a joint on which jumps are searched (chosen)."""


class ExtremeLength(NamedTuple):
    """An extreme length [m] with the positions of the joints of the route (J,)."""

    length: float
    positions: Array


class LengthJump(NamedTuple):
    """A jump of the length of a route [m] over a joint: the pose before it, and its size."""

    joint: str
    positions: Array
    size: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RouteSweep(ShortRepr):
    """A route over the ranges of its joints.

    poses     sampled poses of its joints
    length    lengths [m] (N,)
    slope     derivatives of the length by the joints [m/rad or 1] (N, J)
    shortest  least length; of a route without a path the least change of length
    longest   greatest length
    jumps     jumps of the length, where wrapping changes its side

    The moment arm of a pull is -dL/dq: positive if the route pulls the joint towards greater
    positions.
    """

    route: BodyRoute
    poses: Poses
    length: Array
    slope: Array
    shortest: ExtremeLength
    longest: ExtremeLength
    jumps: tuple[LengthJump, ...]

    @property
    def stroke(self) -> float:
        """Difference of the greatest and the least length [m]."""
        return self.longest.length - self.shortest.length

    @property
    def stroke_share(self) -> float | None:
        """Stroke over the greatest length; None for a route without a path."""
        return self.stroke / self.longest.length if self.route.is_path else None

    @property
    def moment_arm(self) -> Array:
        """Moment arms -dL/dq of a pull (N, J) [m or 1]."""
        return -self.slope

    @property
    def shares(self) -> Array:
        """Part of each joint (J,) in the changes of the length: the mean magnitude of its moment
        arm times its range, over the sum of all.
        """
        spans = np.ptp(self.poses.positions, axis=0)
        parts = np.abs(self.slope).mean(axis=0) * spans
        total = float(parts.sum())
        return np.asarray(parts / total if total > 0.0 else parts)

    def arm_range(self, joint: str) -> tuple[float, float]:
        """Least and greatest moment arm of a joint [m or 1]."""
        arms = self.moment_arm[:, self.route.joints.index(joint)]
        return float(arms.min()), float(arms.max())

    def row_of(self, joint: str, greatest: bool) -> int:
        """The sampled pose with the least or greatest moment arm of a joint."""
        arms = self.moment_arm[:, self.route.joints.index(joint)]
        return int(arms.argmax() if greatest else arms.argmin())


def sweep_routes(
    body: Body,
    poses: Poses | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> tuple[RouteSweep, ...]:
    """The sweeps of all routes of a body, over the ranges of their joints or over stated poses.

    Routes of the same joints share their poses. The extreme lengths over ranges are refined from
    the best samples with the derivatives of the length.
    """
    kinematics = BodyKinematics(body)
    groups: dict[tuple[str, ...], list[BodyRoute]] = {}
    for route in body.routes:
        groups.setdefault(route.joints, []).append(route)
    sweeps: dict[str, RouteSweep] = {}
    for number, (joints, routes) in enumerate(groups.items()):
        if poses is None:
            sweeps |= _swept(kinematics, joints, routes)
        else:
            sweeps |= _sampled(kinematics, joints, routes, poses)
        progress((number + 1) / len(groups))
    return tuple(sweeps[route.name] for route in body.routes)


def _sampled(
    kinematics: BodyKinematics, joints: tuple[str, ...], routes: list[BodyRoute], poses: Poses
) -> dict[str, RouteSweep]:
    """The sweeps over stated poses, whose joints are those of the routes."""
    reference = [kinematics.body.joints[name].reference for name in joints]
    positions = np.tile(reference, (len(poses), 1)) if joints else np.zeros((len(poses), 0))
    for column, name in enumerate(joints):
        if name in poses.joints:
            positions[:, column] = poses.positions[:, poses.joints.index(name)]
    stated = Poses(joints, positions)
    samples = kinematics.samples(routes, stated)
    sweeps = {}
    for number, route in enumerate(routes):
        length = samples.length[:, number]
        ends = [
            ExtremeLength(float(length[row]), positions[row])
            for row in (int(length.argmin()), int(length.argmax()))
        ]
        sweeps[route.name] = RouteSweep(
            route, stated, length, samples.slope[:, number], ends[0], ends[1], ()
        )
    return sweeps


def _swept(
    kinematics: BodyKinematics, joints: tuple[str, ...], routes: list[BodyRoute]
) -> dict[str, RouteSweep]:
    """The sweeps over the ranges of the joints."""
    poses = swept_poses(kinematics.body, joints)
    samples = kinematics.samples(routes, poses)
    sweeps = {}
    for number, route in enumerate(routes):
        length = samples.length[:, number]
        ends = [
            _refined(kinematics, route, poses, length, sign) if joints else _only(length)
            for sign in (1.0, -1.0)
        ]
        sweep = RouteSweep(route, poses, length, samples.slope[:, number], ends[0], ends[1], ())
        jumps = tuple(_jumps(kinematics, sweep)) if route.is_path else ()
        sweeps[route.name] = dataclasses.replace(sweep, jumps=jumps)
    return sweeps


def _only(length: Array) -> ExtremeLength:
    return ExtremeLength(float(length[0]), np.zeros(0))


def _refined(
    kinematics: BodyKinematics, route: BodyRoute, poses: Poses, length: Array, sign: float
) -> ExtremeLength:
    """The least (sign 1) or greatest (-1) length, refined from the best samples within the
    ranges; lengths of isolated poses are left out.
    """
    from scipy.optimize import minimize

    line = _ScaledRoute(kinematics, route)
    count = STARTS_OF_GRID if len(poses.joints) <= 3 else STARTS_OF_SOBOL
    order = np.argsort(sign * length)
    rows = list(
        itertools.islice(
            (row for row in order if not line.is_isolated(poses.positions[row])), count
        )
    )
    best = rows[0] if rows else int(order[0])
    extreme = ExtremeLength(float(length[best]), poses.positions[best])
    for row in rows:
        solution: Any = minimize(
            line.value_and_gradient,
            line.scaled(poses.positions[row]),
            args=(sign,),
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, 1.0)] * len(poses.joints),
            options={"ftol": 1e-10, "gtol": 1e-9},
        )
        positions = line.positions(solution.x)
        if solution.fun < sign * extreme.length and not line.is_isolated(positions):
            extreme = ExtremeLength(sign * float(solution.fun), positions)
    return extreme


class _ScaledRoute:
    """The length of a route over positions that are scaled to the ranges of its joints, 0 to 1."""

    def __init__(self, kinematics: BodyKinematics, route: BodyRoute) -> None:
        joints = [kinematics.body.joints[name] for name in route.joints]
        self.kinematics = kinematics
        self.route = route
        self.low = np.array([joint.low for joint in joints])
        self.span = np.array([joint.high - joint.low for joint in joints])
        self.wraps = any(point.startswith(WRAPS) for point in route.points)

    def scaled(self, positions: Array) -> Array:
        return np.asarray((positions - self.low) / self.span)

    def positions(self, scaled: Array) -> Array:
        return np.asarray(self.low + self.span * scaled)

    def value_and_gradient(self, scaled: Array, sign: float) -> tuple[float, Array]:
        """The length and its gradient, times the sign."""
        sample = self._samples(self.positions(scaled)[None, :])
        return sign * float(sample.length[0, 0]), sign * sample.slope[0, 0] * self.span

    def is_isolated(self, positions: Array) -> bool:
        """Whether the length at a pose differs from that of its neighbours."""
        if not self.wraps:
            return False
        generator = np.random.default_rng(0)
        offsets = generator.uniform(-1.0, 1.0, (NEIGHBOURS, len(positions)))
        around = np.clip(self.scaled(positions) + NEIGHBOURHOOD * offsets, 0.0, 1.0)
        points = np.concatenate([positions[None, :], self.positions(around)])
        length = self._samples(points).length[:, 0]
        return bool(abs(length[0] - np.median(length[1:])) > JUMP)

    def _samples(self, positions: Array) -> RouteSamples:
        return self.kinematics.samples([self.route], Poses(self.route.joints, positions))


def _jumps(kinematics: BodyKinematics, sweep: RouteSweep) -> Sequence[LengthJump]:
    """The greatest jump over each joint, on lines through the reference and both extreme poses.

    A jump is a change of length between neighbours that their moment arms do not give; it must
    remain where the neighbours approach, which a steep but continuous length does not.
    """
    if not any(point.startswith(WRAPS) for point in sweep.route.points):
        return ()
    joints = [kinematics.body.joints[name] for name in sweep.route.joints]
    reference = np.clip(
        [joint.reference for joint in joints],
        [joint.low for joint in joints],
        [joint.high for joint in joints],
    )
    jumps = []
    for column, joint in enumerate(joints):
        worst: LengthJump | None = None
        for start in (reference, sweep.shortest.positions, sweep.longest.positions):
            jump = _jump_on_line(kinematics, sweep, column, start, (joint.low, joint.high))
            if jump is not None and (worst is None or jump.size > worst.size):
                worst = jump
        if worst is not None:
            jumps.append(worst)
    return jumps


def _jump_on_line(
    kinematics: BodyKinematics,
    sweep: RouteSweep,
    column: int,
    start: Array,
    ends: tuple[float, float],
) -> LengthJump | None:
    """The greatest jump of the length on a line over one joint; None without.

    The interval of the greatest excess is divided until a steep length has none. The lengths on
    both sides of what remains must differ, too, which those around an isolated pose do not.
    """
    low, high = ends
    samples = _samples_on_line(
        kinematics, sweep, column, start, np.linspace(low, high, LINE_POINTS)
    )
    places = np.linspace(low, high, LINE_POINTS)
    for _ in range(2):
        excess = _excess(samples, column, places)
        row = int(excess.argmax())
        if excess[row] < JUMP:
            return None
        places = np.linspace(places[row], places[row + 1], LINE_POINTS)
        samples = _samples_on_line(kinematics, sweep, column, start, places)
    row = int(_excess(samples, column, places).argmax())
    step = NEIGHBOURHOOD * (high - low)
    steps = step * np.arange(1, NEIGHBOURS + 1)
    before = _samples_on_line(kinematics, sweep, column, start, places[row] - steps)
    after = _samples_on_line(kinematics, sweep, column, start, places[row] + steps)
    # each side as a tangent to the place of the jump
    ends_of_sides = [
        float(np.median(side.length[:, 0] + sign * side.slope[:, 0, column] * steps))
        for side, sign in ((before, 1.0), (after, -1.0))
    ]
    size = abs(ends_of_sides[1] - ends_of_sides[0])
    if size < JUMP:
        return None
    positions = np.array(start)
    positions[column] = places[row]
    return LengthJump(sweep.route.joints[column], positions, size)


def _samples_on_line(
    kinematics: BodyKinematics, sweep: RouteSweep, column: int, start: Array, places: Array
) -> RouteSamples:
    """Samples of a route with one joint at the places, and the others as at the start."""
    positions = np.tile(start, (len(places), 1))
    positions[:, column] = places
    return kinematics.samples([sweep.route], Poses(sweep.route.joints, positions))


def _excess(samples: RouteSamples, column: int, places: Array) -> Array:
    """Differences between changes of the length and the integrals of its derivative."""
    slope = samples.slope[:, 0, column]
    expected = 0.5 * (slope[1:] + slope[:-1]) * np.diff(places)
    return np.asarray(np.abs(np.diff(samples.length[:, 0]) - expected))
