"""Torques over angles that a route must give, in one or several configurations of a body."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Array, FileError, ParameterError, check_known, counted
from .body import Body
from .kinematics import BodyKinematics, Poses
from .poses import factor_of, named_heading, numbers_of, read_table_of_numbers

WORDS = ("route", "joint", "configuration")
"""Columns of a table of curves that are texts."""
ANGLE = "angle"
TORQUE = "torque"
OUTSIDE = 1e-6
"""Part of the range of a joint by which an angle may be outside it, for rounding."""


class TorqueRows(NamedTuple):
    """The torques that are demanded of a route.

    route          its name
    poses          of all joints of routes (N, J)
    joint          index of the joint of each torque in `poses` (N,)
    torque         torques [N m] or forces [N] (N,), positive towards greater positions
    configuration  name of the configuration of each row (N,)
    """

    route: str
    poses: Poses
    joint: Array
    torque: Array
    configuration: tuple[str, ...]

    @property
    def scale(self) -> Array:
        """Greatest torque of the configuration and joint of each row (N,)."""
        groups = list(zip(self.joint.tolist(), self.configuration, strict=True))
        greatest = dict.fromkeys(groups, 0.0)
        for group, torque in zip(groups, self.torque, strict=True):
            greatest[group] = max(greatest[group], abs(float(torque)))
        of_rows = [greatest[group] for group in groups]
        return np.array(of_rows)


def read_curves(body: Body, path: Path) -> tuple[TorqueRows, ...]:
    """The curves of a CSV file with the columns joint, angle and torque, 'angle [deg]' and 'torque
    [N m]'; optionally route, configuration, and the positions of other joints, 'hip [deg]', which
    are at their reference without.

    Without the column route, a torque is demanded of the only route that pulls the joint in its
    direction. Raises FileError and ParameterError.
    """
    heading, *lines = read_table_of_numbers(path)
    names = []
    units = []
    for number, text in enumerate(heading, 1):
        name, unit = named_heading(text, f"{path}: heading {number}")
        names.append(name)
        units.append(unit)
    for needed in ("joint", ANGLE, TORQUE):
        if needed not in names:
            raise FileError(
                f"{path}: it has no column {needed!r}; a table of curves has joint, angle [deg] and"
                " torque [N m], and may have route, configuration and the positions of other"
                " joints."
            )
    others = [name for name in names if name not in (*WORDS, ANGLE, TORQUE)]
    check_known(f"{path}: there is no joint of a route", others, body.moving)
    if len(set(names)) < len(names):
        raise FileError(f"{path}: two columns have the same name.")
    for number, line in enumerate(lines, 2):
        if len(line) != len(names):
            raise FileError(
                f"{path}: row {number} has {len(line)} cells; the heading has {len(names)}."
            )
    texts = {
        name: [line[names.index(name)].strip() for line in lines] for name in WORDS if name in names
    }
    numeric = [column for column, name in enumerate(names) if name not in WORDS]
    values = numbers_of(
        path, [[line[column] for column in numeric] for line in lines], len(numeric)
    )
    reader = _CurveReader(body, path, texts["joint"])
    columns = {
        names[column]: reader.converted(names[column], units[column], values[:, place])
        for place, column in enumerate(numeric)
    }
    configurations = tuple(texts.get("configuration", [""] * len(lines)))
    return reader.curves(columns, configurations, texts.get("route"))


class _CurveReader:
    """Reader of the rows of a table, with the joint of each."""

    def __init__(self, body: Body, path: Path, joints: list[str]) -> None:
        check_known(f"{path}: there is no joint of a route", joints, body.moving)
        self.body = body
        self.path = path
        self.joints = joints
        kinds = {body.joints[name].is_hinge for name in joints}
        if len(kinds) > 1:
            raise FileError(
                f"{path}: hinges and slides have angles in deg and m; give them in two files."
            )
        self.is_hinge = kinds.pop()

    def converted(self, name: str, unit: str, values: Array) -> Array:
        """A column in SI units."""
        where = f"{self.path}: column {name}"
        if name == TORQUE:
            target = "N m" if self.is_hinge else "N"
        elif name == ANGLE:
            target = "rad" if self.is_hinge else "m"
        else:
            target = self.body.joints[name].unit
        return np.asarray(values * factor_of(unit or target, target, where))

    def curves(
        self,
        columns: dict[str, Array],
        configurations: tuple[str, ...],
        routes: list[str] | None,
    ) -> tuple[TorqueRows, ...]:
        """The rows of each route."""
        moving = self.body.moving
        positions = np.tile(
            [
                np.clip(joint.reference, joint.low, joint.high)
                for joint in (self.body.joints[name] for name in moving)
            ],
            (len(self.joints), 1),
        )
        for name in set(columns) - {ANGLE, TORQUE}:
            positions[:, moving.index(name)] = columns[name]
        joint = np.array([moving.index(name) for name in self.joints])
        positions[np.arange(len(joint)), joint] = columns[ANGLE]
        self._check_positions(positions)
        torque = columns[TORQUE]
        poses = Poses(moving, positions)
        names = self._routes(poses, joint, torque) if routes is None else routes
        check_known(f"{self.path}: there is no route", names, [r.name for r in self.body.routes])
        curves = []
        for name in dict.fromkeys(names):
            rows = np.array([number for number, other in enumerate(names) if other == name])
            self._check_crossed(name, rows)
            curves.append(
                TorqueRows(
                    name,
                    poses.selected(rows),
                    joint[rows],
                    torque[rows],
                    tuple(configurations[row] for row in rows),
                )
            )
        return tuple(curves)

    def _check_positions(self, positions: Array) -> None:
        """Raise ParameterError for positions outside the ranges of their joints."""
        for column, name in enumerate(self.body.moving):
            joint = self.body.joints[name]
            room = OUTSIDE * (joint.high - joint.low) if joint.is_limited else 0.0
            values = positions[:, column]
            outside = (values < joint.low - room) | (values > joint.high + room)
            if outside.any():
                row = int(np.flatnonzero(outside)[0])
                raise ParameterError(
                    f"{self.path}: row {row + 2} has {name} at {joint.shown(values[row])}, outside"
                    f" its range, {joint.shown(joint.low)} to {joint.shown(joint.high)}. Shorten"
                    " the curve, or widen the range with --range (ranges=...)."
                )

    def _check_crossed(self, route: str, rows: Array) -> None:
        crossed = self.body.route(route).joints
        for row in rows:
            if self.joints[row] not in crossed:
                raise ParameterError(
                    f"{self.path}: row {row + 2} demands a torque at {self.joints[row]} of the"
                    f" route {route}, which does not cross this joint; it crosses"
                    f" {', '.join(crossed)}."
                )

    def _routes(self, poses: Poses, joint: Array, torque: Array) -> list[str]:
        """The route that pulls in the direction of each torque."""
        routes = self.body.routes
        slopes = BodyKinematics(self.body).samples(routes, poses).slope
        names = []
        for row in range(len(torque)):
            arms = -slopes[row, :, joint[row]] * np.sign(torque[row])
            pulling = [route.name for route, arm in zip(routes, arms, strict=True) if arm > 0.0]
            if len(pulling) != 1:
                shown = counted(len(pulling), "route") if pulling else "no route"
                listed = f" ({', '.join(pulling)})" if pulling else ""
                raise ParameterError(
                    f"{self.path}: row {row + 2}: {shown}{listed} can give {torque[row]:.4g} N m at"
                    f" {self.joints[row]}; add a column 'route' that names the one that must."
                )
            names.append(pulling[0])
        return names
