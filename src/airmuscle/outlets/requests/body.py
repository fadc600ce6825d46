"""Requests of a body: its files and the ranges of its joints, what is demanded of its routes, which
muscles it may have, and which of its points may be moved.
"""

import contextlib
from collections.abc import Callable
from pathlib import Path

from ...core import UnitError
from ...design.body import Body, BodyStudy, read_body, read_direction, read_range, study_body
from ...design.body.moved_routes import MovedRoutes
from ...design.body.moves import MoveRequest, read_move, read_moves
from ...design.body.moving import STARTS, move_routes
from ...design.body.route_muscle import CRITERIA
from ...design.body.torque_curve import read_curves
from ...design.sizing import SizingConditions
from ...engine.processes import Workers
from ...files.library import Entry, load_law, load_valve
from ...physics.pneumatics import Orifice
from .declaration import RequestError, Where, many, option, optional, request
from .reading import Pairs


def read_joint_range(text: str, where: str) -> tuple[str, tuple[float, float]]:
    """Joint and range [rad or m] of a text such as "knee=-60 deg..0 deg". Raises InputError."""
    joint, separator, limits = text.partition("=")
    if not separator or not joint.strip():
        raise RequestError(
            f"{where} is '{text}'; give a joint and its range: 'knee=-60 deg..0 deg'."
        )
    with contextlib.suppress(UnitError):
        return joint.strip(), read_range(limits, "rad", where)
    return joint.strip(), read_range(limits, "m", where)


@request
class BodyFileRequest:
    """How a body is read."""

    routes: Path | None = optional(
        "TOML file of further routes: [[route]] with name and points.", metavar="FILE"
    )
    range: Pairs = many(
        "Range of a joint in place of that of the file: 'knee=-60 deg..0 deg'. Repeatable.",
        metavar="JOINT=LOW..HIGH",
        read=read_joint_range,
    )
    leave_out: tuple[str, ...] = many("Route that is left out; repeatable.", metavar="ROUTE")
    folder: Path | None = optional(
        "Folder from which the body may read files; by default that of the file.", metavar="DIR"
    )
    without_meshes: bool = optional("Leave out geoms and textures of files.")

    def body(self, path: Path) -> Body:
        """The body of a file. Raises FileError and ParameterError."""
        return read_body(
            path,
            routes=self.routes,
            ranges=dict(self.range),
            leave_out=self.leave_out,
            folder=self.folder,
            without_meshes=bool(self.without_meshes),
        )


@request
class BodyRequest:
    """What the routes of a body are asked for."""

    poses: Path | None = optional(
        "CSV file of the poses that the body reaches, a column 'knee [deg]' for each joint, in"
        " place of the ranges.",
        metavar="FILE",
    )
    motion: Path | None = optional(
        "CSV file of a motion, 'time [s]' and a column for each joint, whose torques are demanded.",
        metavar="FILE",
    )
    torques: Path | None = optional(
        "CSV file of demanded torques: joint, angle [deg], torque [N m].", metavar="FILE"
    )
    positive: Pairs = many(
        "Direction of the positive positions of a joint: 'knee=extension'. Repeatable.",
        metavar="JOINT=DIRECTION",
        read=read_direction,
    )
    max_contraction: float | None = optional(
        "Greatest contraction of a muscle, such as '20 %'; by default that of the catalogue.",
        unit="1",
    )

    def study(self, body: Body, progress: Callable[[float], None]) -> BodyStudy:
        """The study of a body. Raises FileError and ParameterError."""
        return study_body(
            body,
            poses=self.poses,
            motion=self.motion,
            torques=self.torques,
            positive=dict(self.positive),
            max_contraction=self.max_contraction,
            progress=progress,
        )


@request
class FitOutRequest:
    """Which muscles a body may have."""

    supply: float = option("Supply pressure: '6 bar' (gauge).", unit="Pa")
    safety: float = option(
        "Factor on the demanded tension.", unit="1", metavar="NUMBER", default="1.5"
    )
    max_count: int = option("Maximum number of muscles side by side.", default=3)
    muscle: tuple[str, ...] = many(
        "Muscle or file instead of the catalogue; repeatable.", metavar="NAME"
    )
    least: str = option(
        f"What is made least: {', '.join(CRITERIA)}.",
        choices=CRITERIA,
        default="air",
        metavar="KEY",
    )

    valve: str | None = optional(
        "Valve of the library or a file, one for each muscle, with whose flow that of --motion is"
        " compared.",
        metavar="NAME",
    )
    plugins: bool = optional(
        "Build MuJoCo plugins with the laws of the muscles, in DIR/plugins; needs a C compiler."
    )

    def conditions(self) -> SizingConditions:
        """The conditions of the choice. Raises ParameterError."""
        return SizingConditions(self.supply, self.safety, max_count=self.max_count)

    def orifice(self) -> Orifice | None:
        """The valve that is named; None without. Raises UnknownNameError and FileError."""
        return None if self.valve is None else load_valve(self.valve).valve

    def entries(self) -> tuple[Entry, ...] | None:
        """The muscles that are named; None without. Raises UnknownNameError and FileError."""
        return tuple(map(load_law, self.muscle)) or None


@request
class RouteRequest:
    """Which points of the routes of a body may be moved, for which torques and muscles."""

    curves: Path = option(
        "CSV file of demanded torques: joint, angle [deg], torque [N m]; optionally route,"
        " configuration, and positions of other joints, 'hip [deg]'.",
        metavar="FILE",
    )
    supply: float = option("Supply pressure: '6 bar' (gauge).", unit="Pa")
    move: tuple[MoveRequest, ...] = many(
        "Point that may be moved: 'SITE within box 10 mm..40 mm, -5 mm..5 mm, -9 cm..-5 cm', 'SITE"
        " within 20 mm', 'SITE on GEOM', with ', clearance 5 mm from GEOM'. Repeatable.",
        metavar="MOVE",
        read=read_move,
    )
    moves: Path | None = optional(
        "TOML file of points that may be moved: [[move]] with site, and box, within or on.",
        metavar="FILE",
    )
    muscle: tuple[str, ...] = many(
        "Muscle or file instead of the catalogue; repeatable.", metavar="NAME"
    )
    max_count: int = option("Maximum number of muscles side by side.", default=3)
    max_length: float = option("Maximum nominal length.", unit="m", default="2 m")
    safety: float = option(
        "Factor on the torques.", unit="1", metavar="NUMBER", default="1", bounds=(0.01, 100.0)
    )
    starts: int = option("Starts of each search.", default=STARTS, bounds=(1, 1024))

    def check(self, where: Where) -> None:
        """Refuse a request without a point that may be moved."""
        if not self.move and self.moves is None:
            raise RequestError(
                f"give the points that may be moved with {where('move')} or {where('moves')}, such"
                " as 'knee_insertion within 20 mm'."
            )

    def result(
        self, body: Body, workers: Workers, progress: Callable[[float], None]
    ) -> MovedRoutes:
        """The moved routes of a body. Raises FileError, ParameterError and SolveError."""
        moves = self.move
        if self.moves is not None:
            moves = (*moves, *read_moves(self.moves))
        conditions = SizingConditions(
            self.supply, max_length=self.max_length, max_count=self.max_count
        )
        return move_routes(
            body,
            read_curves(body, self.curves),
            moves,
            conditions,
            tuple(map(load_law, self.muscle)) or None,
            factor=self.safety,
            starts=self.starts,
            workers=workers,
            progress=progress,
        )
