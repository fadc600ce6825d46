"""Request of the study of a body: its files, the ranges of its joints, and what is demanded."""

import contextlib
from collections.abc import Callable
from pathlib import Path

from ...core import UnitError
from ...design.body import Body, BodyStudy, read_body, read_direction, read_range, study_body
from ...design.body.route_muscle import CRITERIA
from ...design.sizing import SizingConditions
from ...files.library import Entry, load_law
from .declaration import RequestError, many, option, optional, request
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
class BodyRequest:
    """How a body is read, and what its routes are asked for."""

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

    def study(self, path: Path, progress: Callable[[float], None]) -> BodyStudy:
        """The study of the body of a file. Raises FileError and ParameterError."""
        return study_body(
            self.body(path),
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

    plugins: bool = optional(
        "Build MuJoCo plugins with the laws of the muscles, in DIR/plugins; needs a C compiler."
    )

    def conditions(self) -> SizingConditions:
        """The conditions of the choice. Raises ParameterError."""
        return SizingConditions(self.supply, self.safety, max_count=self.max_count)

    def entries(self) -> tuple[Entry, ...] | None:
        """The muscles that are named; None without. Raises UnknownNameError and FileError."""
        return tuple(map(load_law, self.muscle)) or None
