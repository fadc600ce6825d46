"""`airmuscle body`: what the muscle routes of a robot's body ask of muscles, and their faults."""

from pathlib import Path
from typing import Annotated

from ...core import check_writable
from ..requests.body import BodyFileRequest, BodyRequest
from .delivery import deliver
from .options import Json, OptionalFolder
from .parser import Argument
from .requested import with_requests
from .terminal import progress_bars

BodyFile = Annotated[Path, Argument("BODY.xml", "A body with routes: MJCF or URDF.")]


@with_requests
def body(
    path: BodyFile,
    file: BodyFileRequest,
    request: BodyRequest,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Study the routes of muscles on a robot's body.

    \b
    Every spatial tendon of the MJCF or URDF is a route. Over the ranges of the joints: least and
    greatest length with the poses, moment arms with their sign, the torque of gravity, of a motion
    or of a table, and the tensions that give it. Named are routes whose stroke no muscle serves,
    that pull against their name or twin, change their sign, pass through the body, or cannot hold
    gravity. MuJoCo computes the geometry (pip install "airmuscle[mujoco]").

    \b
    Examples:
      airmuscle body leg.xml --out leg
      airmuscle body leg.xml --motion walk.csv --positive knee=extension
      airmuscle body leg.urdf --routes routes.toml --range "knee=-60 deg..0 deg"
    """
    if out is not None:
        check_writable(out)
    with progress_bars("poses") as show:
        study = request.study(file.body(path), lambda fraction: show("", fraction))
    deliver("body", [study.chapter()], json=json, out=out, title="Body")
