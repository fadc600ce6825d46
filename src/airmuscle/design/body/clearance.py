"""Clearance of routes: the least distance between the straight parts of a route and the geoms of
the body that can collide.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array
from .body import Body
from .kinematics import BodyKinematics, Poses
from .sweep import RouteSweep

POSES = 48
"""Sampled poses in which a clearance is measured, besides the extreme ones (chosen)."""
THIN = 1e-4
"""Radius [m] of the cylinder that stands for a line (chosen)."""
FAR = 0.05
"""Distance [m] from which on a geom is not measured (chosen)."""
SHORTEST_PART = 1e-3
"""Length [m] below which a straight part is not measured (chosen)."""
SHOWN_GROUPS = 2
"""Greatest group of geoms that MuJoCo shows; the others are often skins, beyond the muscles."""
NOT_MEASURED = ("PLANE", "HFIELD", "SDF", "NONE")


class Clearance(NamedTuple):
    """The least distance of a route from a geom [m], negative inside it, and the pose (J,)."""

    distance: float
    geom: str
    positions: Array


class StraightPart(NamedTuple):
    """A straight part of a route [m], and the geoms that it may touch: those around which it wraps,
    and those in which it is attached.
    """

    start: Array
    end: Array
    touching: frozenset[int]


def clearances(body: Body, sweeps: Sequence[RouteSweep]) -> list[Clearance | None]:
    """The least clearance of each route; None where no geom comes near it that can collide.

    Left out are geoms without collisions (contype and conaffinity 0), invisible ones, those of the
    groups from 3 on, planes, height fields, and those around which routes wrap.
    """
    probe = _Probe(body)
    return [probe.least(sweep) if sweep.route.is_path else None for sweep in sweeps]


class _Probe:
    """A thin cylinder that is placed on the straight parts of routes; MuJoCo measures no depth of a
    capsule in a box.
    """

    def __init__(self, body: Body) -> None:
        spec = body.file.specification()
        # a URDF loses geoms that cannot collide
        cylinder = spec.worldbody.add_geom(name="airmuscle_probe", contype=1, conaffinity=1)
        self.kinematics = BodyKinematics(body)
        mujoco = self.kinematics.mujoco
        cylinder.type = mujoco.mjtGeom.mjGEOM_CYLINDER
        cylinder.size = [THIN, 1.0, 0.0]
        cylinder.mass = 0.0
        self.model = body.file.compiled(spec)
        self.mujoco = mujoco
        self.data = mujoco.MjData(self.model)
        self.cylinder = int(self.model.geom("airmuscle_probe").id)
        left_out = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind}")) for kind in NOT_MEASURED}
        self.turn = np.zeros(4)
        self.frame = np.eye(3).ravel()
        self.nearest = np.zeros(6)
        wrapped = self._wrapped()
        self.geoms = [
            geom
            for geom in range(self.model.ngeom)
            if (self.model.geom_contype[geom] or self.model.geom_conaffinity[geom])
            and self.model.geom_rgba[geom, 3] > 0.0
            and self.model.geom_group[geom] <= SHOWN_GROUPS
            and int(self.model.geom_type[geom]) not in left_out
            and geom not in {*wrapped, self.cylinder}
        ]

    def _wrapped(self) -> set[int]:
        """The geoms around which routes wrap: surfaces of muscles, not of the body."""
        around = {int(self.mujoco.mjtWrap.mjWRAP_SPHERE), int(self.mujoco.mjtWrap.mjWRAP_CYLINDER)}
        kinds = self.model.wrap_type.tolist()
        return {
            int(geom)
            for kind, geom in zip(kinds, self.model.wrap_objid, strict=True)
            if kind in around
        }

    def least(self, sweep: RouteSweep) -> Clearance | None:
        """The least clearance of a route over a part of its sampled poses and the extreme ones."""
        if not self.geoms:
            return None
        step = max(1, len(sweep.poses) // POSES)
        positions = np.concatenate(
            [
                sweep.poses.positions[::step],
                [sweep.shortest.positions, sweep.longest.positions],
            ]
        )
        poses = Poses(sweep.route.joints, positions)
        least: Clearance | None = None
        for number, row in enumerate(self.kinematics.rows(poses)):
            self._place(row)
            for segment in self._segments(sweep.route.index):
                for geom in self._near(segment.start, segment.end, FAR):
                    if geom in segment.touching:
                        continue
                    distance = self._distance(segment.start, segment.end, geom)
                    if distance < (FAR if least is None else least.distance):
                        name = self.model.geom(geom).name or f"geom {geom}"
                        least = Clearance(distance, name, positions[number])
        return least

    def _place(self, row: Array) -> None:
        self.data.qpos[:] = row
        self.mujoco.mj_kinematics(self.model, self.data)
        self.mujoco.mj_comPos(self.model, self.data)
        self.mujoco.mj_tendon(self.model, self.data)

    def _segments(self, tendon: int) -> Iterator[StraightPart]:
        """The straight parts of a path; those around a geom are none."""
        first = int(self.data.ten_wrapadr[tendon])
        points = np.reshape(self.data.wrap_xpos, (-1, 3))
        objects = np.ravel(self.data.wrap_obj)
        for place in range(first, first + int(self.data.ten_wrapnum[tendon]) - 1):
            ends = [int(objects[place]), int(objects[place + 1])]
            is_arc = ends[0] == ends[1] >= 0
            is_pulley = -2 in ends
            start = np.array(points[place])
            end = np.array(points[place + 1])
            if is_arc or is_pulley or np.linalg.norm(end - start) < SHORTEST_PART:
                continue
            attached = {
                geom
                for point in (start, end)
                for geom in self._near(point, point, SHORTEST_PART)
                if self._distance(point, point, geom) <= SHORTEST_PART
            }
            yield StraightPart(start, end, frozenset({*ends, *attached}))

    def _near(self, start: Array, end: Array, reach: float) -> list[int]:
        """The geoms whose bounding sphere is within a reach [m] of a straight part."""
        along = end - start
        offsets = self.data.geom_xpos[self.geoms] - start
        square = float(along @ along)
        fraction = np.clip(offsets @ along / square, 0.0, 1.0) if square > 0.0 else np.zeros(1)
        offsets = offsets - np.reshape(fraction, (-1, 1)) * along
        radii = self.model.geom_rbound[self.geoms] + reach
        is_near = (offsets**2).sum(axis=1) <= radii**2
        return [self.geoms[number] for number in np.flatnonzero(is_near)]

    def _distance(self, start: Array, end: Array, geom: int) -> float:
        """Distance of a straight part from a geom, at most FAR."""
        half = 0.5 * (end - start)
        length = math.sqrt(float(half @ half))
        if length > 0.0:
            self.mujoco.mju_quatZ2Vec(self.turn, half / length)
            self.mujoco.mju_quat2Mat(self.frame, self.turn)
        self.data.geom_xpos[self.cylinder] = start + half
        self.data.geom_xmat[self.cylinder] = self.frame
        self.model.geom_size[self.cylinder, 1] = max(length, THIN)
        self.model.geom_rbound[self.cylinder] = length + THIN
        distance = self.mujoco.mj_geomDistance(
            self.model, self.data, self.cylinder, geom, FAR, self.nearest
        )
        return min(float(distance) + THIN, FAR)
