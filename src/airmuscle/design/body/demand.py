"""Torque demanded at the joints of a body: by gravity in all poses, by a motion, or by a table of
torques over angles; and the tensions of the routes that give it.
"""

import copy
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...core import Array, FileError, ShortRepr, check_known, quantity
from .body import Body
from .kinematics import BodyKinematics, Poses
from .poses import numbers_of, read_poses, read_table_of_numbers, sobol_points

GRAVITY_POINTS = 1024
"""Poses of a Sobol sequence over the ranges of all joints of routes (chosen)."""
UNMET = 0.02
"""Part of the greatest torque of a joint that may be missing in a pose (chosen)."""
LEAST_TORQUE = 1e-3
"""Torque [N m], or force of a slide [N], below which a demand is nothing (chosen)."""
TABLE_HEADINGS = ("joint", "angle [deg]", "torque [N m]")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TorqueDemand(ShortRepr):
    """Torques that the routes must give in poses of a body.

    name    what demands them: gravity, the file of a motion or of torques
    poses   of all joints of routes (N, J)
    torque  torques [N m] of these joints, forces [N] of slides (N, J); nan where none is stated
    speed   speeds of the joints [rad/s or m/s] (N, J); None where the poses are at rest
    time    instants [s] (N,) of a motion; None of other poses
    """

    name: str
    poses: Poses
    torque: Array
    speed: Array | None = None
    time: Array | None = None


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TensionBalance(ShortRepr):
    """Least tensions of the routes that give a demand.

    demand      the torques
    tension     tensions [N] (N, R), at least the floor of each route
    moment_arm  moment arms of a pull (N, J, R) [m or 1]
    missing     torque that no tensions give (N, J) [N m or N]: demanded less given
    """

    demand: TorqueDemand
    tension: Array
    moment_arm: Array
    missing: Array

    @property
    def is_unmet(self) -> Array:
        """Whether the routes do not give the torque of a joint in a pose (N, J)."""
        greatest = np.nanmax(np.abs(self.demand.torque), axis=0, initial=0.0)
        return np.asarray(np.abs(self.missing) > np.maximum(UNMET * greatest, LEAST_TORQUE))


def gravity_demand(body: Body, poses: Poses | None = None) -> TorqueDemand:
    """The torques that hold the body against gravity and springs, at rest, in a Sobol sequence over
    the ranges of all joints of routes, or in stated poses. A free base is held; nothing touches the
    ground.
    """
    if poses is None:
        joints = [body.joints[name] for name in body.moving]
        ranges = [(joint.low, joint.high) for joint in joints]
        points = sobol_points(ranges, GRAVITY_POINTS) if ranges else np.zeros((1, 0))
        poses = Poses(body.moving, points)
    else:
        poses = _of_moving(body, poses)
    return TorqueDemand("gravity in all poses", poses, _static_torque(body, poses))


def motion_demand(body: Body, path: Path) -> TorqueDemand:
    """The torques of a motion, by inverse dynamics: a CSV file with 'time [s]' and a column for
    each joint. Between its rows the positions are cubic splines. Raises FileError.
    """
    from scipy.interpolate import CubicSpline

    table = read_poses(path, body, needs_time=True)
    assert table.time is not None
    poses = _of_moving(body, table.poses)
    kinematics = BodyKinematics(body)
    spline = CubicSpline(table.time, kinematics.rows(table.poses))
    dynamics = _FreeDynamics(kinematics)
    torque = np.empty((len(poses), len(poses.joints)))
    projection = kinematics.projection(poses)
    speeds = kinematics.speed_rows(spline(table.time, 1))
    accelerations = kinematics.speed_rows(spline(table.time, 2))
    for number, row in enumerate(spline(table.time)):
        forces = dynamics.torque(row, speeds[number], accelerations[number])
        torque[number] = forces @ projection[number]
    columns = [body.joints[name].speed for name in poses.joints]
    return TorqueDemand(path.name, poses, torque, speeds[:, columns], table.time)


def table_demand(body: Body, path: Path) -> TorqueDemand:
    """The torques of a CSV file with the columns joint, angle [deg] and torque [N m]; the other
    joints are at their reference, or the middle of their range. Raises FileError.
    """
    heading, *lines = read_table_of_numbers(path)
    if tuple(cell.strip() for cell in heading) != TABLE_HEADINGS:
        raise FileError(
            f"{path}: its heading is {','.join(heading)!r}; a table of torques has the columns"
            f" {', '.join(TABLE_HEADINGS)}."
        )
    names = [line[0].strip() for line in lines]
    check_known(f"{path}: there is no joint of a route", names, body.moving)
    values = numbers_of(path, [line[1:] for line in lines], 2)
    middle = np.array([_resting(body, name) for name in body.moving])
    positions = np.tile(middle, (len(lines), 1))
    torque = np.full(positions.shape, np.nan)
    degree = quantity("1 deg", "rad")
    for number, name in enumerate(names):
        column = body.moving.index(name)
        factor = degree if body.joints[name].is_hinge else 1e-3
        positions[number, column] = factor * values[number, 0]
        torque[number, column] = values[number, 1]
    return TorqueDemand(path.name, Poses(body.moving, positions), torque)


def balance(
    body: Body,
    demand: TorqueDemand,
    floor: Callable[[Array], Array] | None = None,
    usable: Sequence[bool] | None = None,
) -> TensionBalance:
    """The least tensions that give a demand: the solution of least squares with tensions of at
    least the floor, which takes the lengths (N, R) [m] and returns tensions [N].

    usable  whether each route may pull more than its floor
    """
    from scipy.optimize import nnls

    samples = BodyKinematics(body).samples(body.routes, demand.poses)
    arms = -np.swapaxes(samples.slope, 1, 2)
    floors = np.zeros(samples.length.shape) if floor is None else floor(samples.length)
    tensions = np.array(floors)
    missing = np.zeros(demand.torque.shape)
    free = np.ones(len(body.routes), bool) if usable is None else np.asarray(usable, bool)
    scale = float(np.abs(arms).max(initial=1e-9))
    for number in range(len(demand.poses)):
        stated = np.isfinite(demand.torque[number])
        matrix = arms[number][stated][:, free]
        wanted = demand.torque[number, stated] - arms[number][stated] @ floors[number]
        if matrix.size:
            # a small weight on the tensions makes them the least of several solutions
            weight = 1e-4 * scale * np.eye(matrix.shape[1])
            rows = np.concatenate([matrix, weight])
            sides = np.concatenate([wanted, np.zeros(matrix.shape[1])])
            tensions[number, free] += nnls(rows, sides)[0]
        given = arms[number][stated] @ tensions[number]
        missing[number, stated] = demand.torque[number, stated] - given
    return TensionBalance(demand, tensions, arms, missing)


class _FreeDynamics:
    """Inverse dynamics of a body without contacts, limits and constraints."""

    def __init__(self, kinematics: BodyKinematics) -> None:
        self.mujoco = kinematics.mujoco
        self.model = copy.copy(kinematics.model)
        flags = self.mujoco.mjtDisableBit
        self.model.opt.disableflags |= int(flags.mjDSBL_CONSTRAINT) | int(flags.mjDSBL_CONTACT)
        self.data = self.mujoco.MjData(self.model)

    def torque(self, row: Array, speed: Array, acceleration: Array) -> Array:
        """Torques [N m] or forces [N] (nv) that actuators must give."""
        self.data.qpos[:] = row
        self.data.qvel[:] = speed
        self.data.qacc[:] = acceleration
        self.mujoco.mj_inverse(self.model, self.data)
        return np.array(self.data.qfrc_inverse)


def _static_torque(body: Body, poses: Poses) -> Array:
    """Torques [N m] (N, J) at rest."""
    kinematics = BodyKinematics(body)
    projection = kinematics.projection(poses)
    rest = np.zeros(body.model.nv)
    rows = kinematics.rows(poses)
    dynamics = _FreeDynamics(kinematics)
    forces = np.array([dynamics.torque(row, rest, rest) for row in rows])
    return np.asarray(np.einsum("nv,nvj->nj", forces, projection))


def _of_moving(body: Body, poses: Poses) -> Poses:
    """The poses with all joints of routes, those that are not named at rest."""
    positions = np.tile([_resting(body, name) for name in body.moving], (len(poses), 1))
    for column, name in enumerate(body.moving):
        if name in poses.joints:
            positions[:, column] = poses.positions[:, poses.joints.index(name)]
    return Poses(body.moving, positions.reshape(len(poses), len(body.moving)))


def _resting(body: Body, name: str) -> float:
    """The reference of a joint, within its range."""
    joint = body.joints[name]
    return float(np.clip(joint.reference, joint.low, joint.high))
