"""Geometry of a route whose points move: lengths and moment arms over poses, with their derivatives
by the positions of the points.

A route of straight parts has closed forms: a point of a body is P = t + R p, its derivative by a
joint D p + e, both affine in its position p. Of a route that wraps MuJoCo computes the path,
whose straight parts give the derivatives.
"""

import abc
import copy
import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array
from .body import WRAPS, Body
from .kinematics import BodyKinematics, Poses
from .moves import PointMove
from .torque_curve import TorqueRows

SHORTEST = 1e-9
"""Length [m] of a straight part below which its direction is not divided by it."""
DIFFERENCE = 1e-5
"""Step [rad or m] of the differences of a route that wraps (chosen)."""
SITE = -1
PULLEY = -2
"""MuJoCo's marks of sites and pulleys in the path of a tendon; geoms have their index."""


class GeometryValues(NamedTuple):
    """A route with its points at some positions.

    length        lengths [m] over all poses (P,)
    arm           moment arms [m or 1] of the torques (N,), those of the first poses
    length_slope  derivatives of the lengths by the positions (P, 3 M)
    arm_slope     derivatives of the moment arms (N, 3 M)
    """

    length: Array
    arm: Array
    length_slope: Array
    arm_slope: Array


class RouteGeometry(abc.ABC):
    """Lengths and moment arms of a route for positions of its points that move (interface)."""

    @abc.abstractmethod
    def at(self, points: Array) -> GeometryValues:
        """The values with the points that move at positions (M, 3) in their bodies [m]."""


@dataclasses.dataclass(frozen=True, eq=False)
class StraightRoute(RouteGeometry):
    """A route of straight parts between its points.

    turn, shift   R (P, S, 3, 3) and t (P, S, 3) of each point over the poses
    rate, offset  D (N, S, 3, 3) and e (N, S, 3) of the joint of each torque
    present       positions of all points [m] (S, 3)
    moved         number of the move of each point; -1 for one that stays (S,)
    """

    turn: Array
    shift: Array
    rate: Array
    offset: Array
    present: Array
    moved: Array

    def at(self, points: Array) -> GeometryValues:
        places = self.present.copy()
        moving = self.moved >= 0
        places[moving] = points[self.moved[moving]]
        world = self.shift + np.einsum("psij,sj->psi", self.turn, places)
        part = np.diff(world, axis=1)
        size = np.maximum(np.linalg.norm(part, axis=2), SHORTEST)
        along = part / size[:, :, None]
        count = len(self.rate)
        speed = self.offset + np.einsum("nsij,sj->nsi", self.rate, places)
        relative = np.diff(speed, axis=1)
        near = along[:count]
        arm = -np.einsum("nki,nki->n", near, relative)
        # change of the direction of a part by its end, times its relative speed
        swing = relative - near * np.einsum("nki,nki->nk", near, relative)[:, :, None]
        swing /= size[:count, :, None]
        # what pulls at each point: the part before it less the part behind it
        pull = -np.diff(along, axis=1, prepend=0.0, append=0.0)
        bend = -np.diff(swing, axis=1, prepend=0.0, append=0.0)
        length_slope = np.zeros((len(self.turn), len(points), 3))
        arm_slope = np.zeros((count, len(points), 3))
        for point in np.flatnonzero(moving):
            move = self.moved[point]
            turn = self.turn[:, point]
            rate = self.rate[:, point]
            length_slope[:, move] += _turned(pull[:, point], turn)
            arm_slope[:, move] -= _turned(bend[:, point], turn[:count])
            arm_slope[:, move] -= _turned(pull[:count, point], rate)
        return GeometryValues(
            size.sum(axis=1),
            arm,
            length_slope.reshape(len(self.turn), -1),
            arm_slope.reshape(count, -1),
        )


def _turned(vectors: Array, frames: Array) -> Array:
    """Vectors (N, 3) in frames (N, 3, 3)."""
    return np.asarray(np.einsum("ni,nij->nj", vectors, frames))


@dataclasses.dataclass(frozen=True, eq=False)
class WrappedRoute(RouteGeometry):
    """A route that MuJoCo computes.

    model     `mujoco.MjModel`
    rows      MuJoCo's vectors of positions (P, nq)
    joint     derivatives of the speeds by that of the joint of each torque (N, nv)
    tendon    index of the tendon
    sites     indices of the sites that move
    moved     number of the move of each site of the path; -1 for one that stays (S,)
    divisors  divisors of the branches between pulleys, the first 1

    The derivative of the length by a point is that of the straight parts at its sides, because the
    path around a geom is the shortest; that of the moment arm is its difference over the joint.
    """

    model: Any
    rows: Array
    joint: Array
    tendon: int
    sites: tuple[int, ...]
    moved: Array
    divisors: tuple[float, ...]

    def at(self, points: Array) -> GeometryValues:
        import mujoco

        model = self.model
        data = mujoco.MjData(model)
        if self.sites:
            model.site_pos[list(self.sites)] = points
        first = int(model.ten_J_rowadr[self.tendon])
        end = first + int(model.ten_J_rownnz[self.tendon])
        columns = model.ten_J_colind[first:end]
        length = np.empty(len(self.rows))
        arm = np.empty(len(self.joint))
        length_slope = np.empty((len(self.rows), points.size))
        arm_slope = np.empty((len(self.joint), points.size))
        for number, row in enumerate(self.rows):
            data.qpos[:] = row
            length_slope[number] = self._pulls(mujoco, data)
            length[number] = data.ten_length[self.tendon]
            if number >= len(arm):
                continue
            arm[number] = -np.ravel(data.ten_J)[first:end] @ self.joint[number, columns]
            sides = []
            for step in (DIFFERENCE, -DIFFERENCE):
                data.qpos[:] = row
                mujoco.mj_integratePos(model, data.qpos, self.joint[number], step)
                sides.append(self._pulls(mujoco, data))
            arm_slope[number] = (sides[1] - sides[0]) / (2.0 * DIFFERENCE)
        return GeometryValues(length, arm, length_slope, arm_slope)

    def _pulls(self, mujoco: Any, data: Any) -> Array:
        """Derivative of the length by the positions of the points that move (3 M,), in a pose."""
        model = self.model
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        pulls = np.zeros((len(self.sites), 3))
        start = int(data.ten_wrapadr[self.tendon])
        end = start + int(data.ten_wrapnum[self.tendon])
        path = np.reshape(data.wrap_xpos, (-1, 3))[start:end]
        objects = np.ravel(data.wrap_obj)[start:end]
        site = -1
        branch = 0
        for place, kind in enumerate(objects):
            branch += kind == PULLEY
            site += kind == SITE
            move = self.moved[site]
            if kind != SITE or move < 0:
                continue
            neighbours = [
                path[other]
                for other in (place - 1, place + 1)
                if 0 <= other < len(path) and objects[other] != PULLEY
            ]
            owner = int(model.site_bodyid[self.sites[move]])
            turn = data.xmat[owner].reshape(3, 3)
            pull = _pull_from(path[place], neighbours) @ turn
            pulls[move] += pull / self.divisors[branch]
        return pulls.ravel()


def _pull_from(point: Array, neighbours: Sequence[Array]) -> Array:
    """Sum of the directions from neighbours to a point (3,)."""
    pull = np.zeros(3)
    for other in neighbours:
        part = point - other
        size = float(np.linalg.norm(part))
        pull += part / max(size, SHORTEST)
    return pull


def geometry_of_route(
    body: Body, rows: TorqueRows, further: Poses, moves: Sequence[PointMove]
) -> RouteGeometry:
    """The geometry of a route at the poses of its torques and at further ones."""
    route = body.route(rows.route)
    kinematics = BodyKinematics(body)
    count = len(rows.torque)
    joint = kinematics.projection(rows.poses)[np.arange(count), :, rows.joint]
    positions = np.concatenate([kinematics.rows(rows.poses), kinematics.rows(further)])
    model = body.model
    wraps = kinematics.mujoco.mjtWrap
    first = int(model.tendon_adr[route.index])
    members = range(first, first + int(model.tendon_num[route.index]))
    pulleys = [member for member in members if model.wrap_type[member] == int(wraps.mjWRAP_PULLEY)]
    moved = _moved(route.points, moves)
    if pulleys or any(point.startswith(WRAPS) for point in route.points):
        sites = [move.index for move in moves]
        movable = copy.copy(model)
        movable.site_sameframe[sites] = 0  # else the position of a point at an origin has no effect
        return WrappedRoute(
            movable,
            positions,
            joint,
            route.index,
            tuple(sites),
            moved,
            (1.0, *(float(model.wrap_prm[member]) for member in pulleys)),
        )
    return _straight(kinematics, route.points, positions, joint, moved)


def _moved(points: Sequence[str], moves: Sequence[PointMove]) -> Array:
    """Number of the move of each site of a path, -1 for one that stays."""
    names = [move.site for move in moves]
    sites = [point for point in points if not point.startswith(WRAPS)]
    return np.array([names.index(site) if site in names else -1 for site in sites])


def _straight(
    kinematics: BodyKinematics,
    points: Sequence[str],
    positions: Array,
    joint: Array,
    moved: Array,
) -> StraightRoute:
    """The affine maps of all points of a route, from MuJoCo's frames and Jacobians."""
    model = kinematics.model
    mujoco = kinematics.mujoco
    sites = [int(model.site(name).id) for name in points]
    bodies = [int(model.site_bodyid[site]) for site in sites]
    turn = np.empty((len(positions), len(sites), 3, 3))
    shift = np.empty((len(positions), len(sites), 3))
    rate = np.empty((len(joint), len(sites), 3, 3))
    offset = np.empty((len(joint), len(sites), 3))
    linear = np.zeros((3, model.nv))
    angular = np.zeros((3, model.nv))
    for number, row in enumerate(positions):
        kinematics.place(row)
        for place, owner in enumerate(bodies):
            frame = kinematics.data.xmat[owner].reshape(3, 3)
            turn[number, place] = frame
            shift[number, place] = kinematics.data.xpos[owner]
            if number < len(joint):
                mujoco.mj_jacBody(model, kinematics.data, linear, angular, owner)
                spin = angular @ joint[number]
                rate[number, place] = np.cross(spin, frame, axisb=0, axisc=0)
                offset[number, place] = linear @ joint[number]
    return StraightRoute(turn, shift, rate, offset, np.array(model.site_pos[sites]), moved)
