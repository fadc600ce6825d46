"""`airmuscle route`: points of the routes of a robot's body, moved to meet torques over angles."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from ...core import check_writable
from ..requests.body import BodyFileRequest, RouteRequest
from .delivery import Execution, deliver
from .options import Json, OptionalFolder
from .parser import Argument
from .requested import with_requests
from .terminal import progress_bars

BodyFile = Annotated[Path, Argument("BODY.xml", "A body with routes: MJCF or URDF.")]
BODY_FILE = "body.xml"


@with_requests
def route(
    path: BodyFile,
    request: RouteRequest,
    file: BodyFileRequest,
    execution: Execution,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Move points of routes so that they meet torques over angles.

    \b
    Attachments and via points are moved within bounds. For each route, muscle, number side by side
    and tackle a search from many starts makes the missing part of the torques least, and where none
    is missing the pressure, with the contraction permitted over the ranges of all joints. With
    --out, DIR/body.xml is the body with the new places, the report has the torques before and
    after, the table of moves, and the least number of muscles for each deficit. Completed searches
    are stored in DIR/tasks: after an interruption the same command goes on from there.

    \b
    Examples:
      airmuscle route leg.xml --curves knee.csv --supply "6 bar"
          --move "knee_insertion within 20 mm"
      airmuscle route leg.xml --curves leg.csv --supply "6 bar" --moves moves.toml --out moved
          --workers 2
    """
    if out is not None:
        check_writable(out)
    body = file.body(path)
    with execution.executor(out, alone=True) as workers, progress_bars("routes") as show:
        result = request.result(body, workers, lambda fraction: show("", fraction))
    files: dict[str, str | Callable[[Path], object]] = {}
    if out is not None:
        files[BODY_FILE] = result.text()
    deliver("route", [result.chapter()], json=json, out=out, title="Moved routes", files=files)
