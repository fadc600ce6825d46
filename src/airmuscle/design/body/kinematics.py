"""Lengths of routes and their derivatives by the joints, over poses of a body."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ShortRepr
from .body import Body, BodyRoute
from .joints import following_positions
from .simulator import load_simulator

MOST_NAMED = 6
"""Greatest number of joints of a pose that a text names (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Poses(ShortRepr):
    """Poses of a body: positions [rad or m] (N, J) of the named joints.

    Joints that are not named are at their reference, or follow the named ones.
    """

    joints: tuple[str, ...]
    positions: Array

    def __len__(self) -> int:
        return len(self.positions)

    def described(self, body: Body, row: int) -> str:
        """A pose as text: 'hip 20°, knee -30°'; of many joints the first ones."""
        parts = [
            f"{name} {body.joints[name].shown(float(value))}"
            for name, value in zip(self.joints, self.positions[row], strict=True)
        ]
        if len(parts) > MOST_NAMED:
            rest = len(parts) - MOST_NAMED
            parts = [*parts[:MOST_NAMED], f"and {rest} more"]
        return ", ".join(parts) or "the reference pose"

    def selected(self, rows: Any) -> "Poses":
        """The poses of some rows."""
        return Poses(self.joints, self.positions[rows])


class RouteSamples(NamedTuple):
    """Lengths [m] (N, R) of routes, and their derivatives by the joints of the poses [m/rad or 1]
    (N, R, J).
    """

    length: Array
    slope: Array


class BodyKinematics:
    """A body that can be placed in poses."""

    def __init__(self, body: Body) -> None:
        self.mujoco = load_simulator()
        self.body = body
        self.model = body.model
        self.data = self.mujoco.MjData(body.model)

    def rows(self, poses: Poses) -> Array:
        """MuJoCo's vectors of positions (N, nq) of poses."""
        rows = np.tile(self.model.qpos0, (len(poses), 1))
        named = {name: poses.positions[:, column] for column, name in enumerate(poses.joints)}
        leaders = {joint.coupling.leader for joint in self.body.joints.values() if joint.coupling}
        for name in leaders - set(named):
            joint = self.body.joints[name]
            if joint.coupling is None:
                named[name] = np.full(len(poses), joint.reference)
        for name, values in following_positions(self.body.joints, named).items():
            rows[:, self.body.joints[name].position] = values
        return np.asarray(rows)

    def place(self, row: Array) -> None:
        """Place the body, so far as tendons and geoms need it."""
        self.data.qpos[:] = row
        self.mujoco.mj_kinematics(self.model, self.data)
        self.mujoco.mj_comPos(self.model, self.data)
        self.mujoco.mj_tendon(self.model, self.data)

    def samples(self, routes: Sequence[BodyRoute], poses: Poses) -> RouteSamples:
        """Lengths of routes and their derivatives over poses."""
        tendons = [route.index for route in routes]
        expand = self._expansion(tendons)
        count = len(poses)
        lengths = np.empty((count, len(tendons)))
        slopes = np.empty((count, len(tendons), self.model.nv))
        for number, row in enumerate(self.rows(poses)):
            self.place(row)
            lengths[number] = self.data.ten_length[tendons]
            slopes[number] = expand(self.data.ten_J)
        return RouteSamples(lengths, slopes @ self.projection(poses))

    def _expansion(self, tendons: Sequence[int]) -> Callable[[Array], Array]:
        """The function from MuJoCo's sparse Jacobian of the tendons to that of some, (R, nv)."""
        model = self.model
        width = int(model.nv)
        places: list[int] = []
        targets: list[int] = []
        for number, tendon in enumerate(tendons):
            first = int(model.ten_J_rowadr[tendon])
            for place in range(first, first + int(model.ten_J_rownnz[tendon])):
                places.append(place)
                targets.append(number * width + int(model.ten_J_colind[place]))

        def expand(sparse: Array) -> Array:
            dense = np.zeros(len(tendons) * width)
            dense[targets] = np.ravel(sparse)[places]
            return dense.reshape(len(tendons), width)

        return expand

    def projection(self, poses: Poses) -> Array:
        """Derivatives of all speeds by those of the joints of poses, (N, nv, J), with the joints
        that follow them.
        """
        joints = self.body.joints
        projection = np.zeros((len(poses), self.model.nv, len(poses.joints)))
        followers = [joint for joint in joints.values() if joint.coupling is not None]
        named = {name: poses.positions[:, column] for column, name in enumerate(poses.joints)}
        positions = following_positions(joints, named)
        for column, name in enumerate(poses.joints):
            slopes = {name: np.ones(len(poses))}
            for _ in followers:  # a chain of followers is at most as long as their number
                for joint in followers:
                    assert joint.coupling is not None
                    leader = joint.coupling.leader
                    if leader in slopes:
                        slopes[joint.name] = slopes[leader] * joint.coupling.slope(
                            positions[leader]
                        )
            for moved, slope in slopes.items():
                projection[:, joints[moved].speed, column] = slope
        return projection

    def speed_rows(self, rows: Array) -> Array:
        """Derivatives of the positions of joints (N, nq) as MuJoCo's vectors of speeds (N, nv)."""
        speeds = np.zeros((len(rows), self.model.nv))
        for joint in self.body.joints.values():
            speeds[:, joint.speed] = rows[:, joint.position]
        return speeds


def sample_routes(body: Body, poses: Poses) -> RouteSamples:
    """Lengths of all routes of a body and their derivatives by the joints, over poses."""
    return BodyKinematics(body).samples(body.routes, poses)
