"""`airmuscle fit-out`: the muscles of the routes of a robot's body."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from ...core import check_writable
from ...design.body.fitting_out import fit_out
from ..export.body_muscles import choice_toml, fitted_body
from ..requests.body import BodyFileRequest, BodyRequest, FitOutRequest
from .delivery import deliver
from .options import Json, OptionalFolder
from .parser import Argument
from .requested import with_requests
from .terminal import progress_bars

BodyFile = Annotated[Path, Argument("BODY.xml", "A body with routes: MJCF or URDF.")]
BODY_FILE = "body.xml"
CHOICE_FILE = "muscles.toml"
PLUGIN_FOLDER = "plugins"


@with_requests
def fit_out_command(
    path: BodyFile,
    request: FitOutRequest,
    file: BodyFileRequest,
    body: BodyRequest,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Choose the muscles of a robot's body for its routes.

    \b
    For each route the muscles of least air (or number, length): product, nominal length, number
    side by side, a tackle where none serve without, and the tendon that fills the route. Every pose
    keeps the contraction, and the factor of --safety times the demanded tension within the force at
    the supply. A route that no muscle serves is named with what would serve it. With --out,
    DIR/body.xml is the body with an actuator for each muscle, and DIR/muscles.toml the choice.

    \b
    Examples:
      airmuscle fit-out leg.xml --supply "6 bar" --out leg
      airmuscle fit-out leg.xml --supply "6 bar" --motion walk.csv --least number
          --valve matrix-821
    """
    if out is not None:
        check_writable(out)
    with progress_bars("fit-out") as show:
        study = body.study(file.body(path), lambda fraction: show("poses", fraction))
        result = fit_out(
            study,
            request.conditions(),
            request.entries(),
            request.least,  # type: ignore[arg-type]
            lambda fraction: show("muscles", fraction),
            valve=request.orifice(),
        )
    files: dict[str, str | Callable[[Path], object]] = {}
    if out is not None and result.muscles:
        files[CHOICE_FILE] = choice_toml(result)

        def write_body(target: Path) -> None:
            folder = target.parent / PLUGIN_FOLDER if request.plugins else None
            target.write_text(fitted_body(result, folder).text, encoding="utf-8")

        files[BODY_FILE] = write_body
    deliver("fit-out", [result.chapter()], json=json, out=out, title="Fit-out", files=files)
