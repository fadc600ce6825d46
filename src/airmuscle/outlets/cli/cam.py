"""`airmuscle cam`: pulley of variable radius on which a muscle gives a torque over an angle."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from ...core import check_writable
from ...design.cam import cam_csv, cam_dxf, cam_svg
from ..requests.cam import CamRequest
from .delivery import deliver
from .options import Json, OptionalFolder
from .parser import Argument
from .requested import with_requests

MuscleName = Annotated[str, Argument("MUSCLE", "Muscle of the library, or a muscle file.")]


@with_requests
def cam(
    muscle: MuscleName, request: CamRequest, out: OptionalFolder = None, json: Json = False
) -> None:
    """Design a cam on which a muscle gives a torque over the angle.

    \b
    The moment arm follows from the work of the muscle at the pressure. The outline is the convex
    cam of which the cable is a tangent; where it would not be convex, the angles are named. With
    --out, DIR/cam.dxf and cam.svg are the outline in mm, DIR/profile.csv has moment arm, force and
    point of contact at each angle, and the report shows the cam in three positions.

    \b
    Examples:
      airmuscle cam dmsp-20-300 --pressure "4 bar" --torque "10 N m" --stiffness "4 N m/rad"
          --angle "0 deg..90 deg" --out cam
      airmuscle cam dmsp-20-300 --pressure "4 bar" --curve torque.csv --distance "300 mm"
    """
    if out is not None:
        check_writable(out)
    result = request.cam(muscle)
    files: dict[str, str | Callable[[Path], object]] = {}
    if out is not None:
        files["cam.dxf"] = cam_dxf(result)
        files["cam.svg"] = cam_svg(result)
        files["profile.csv"] = cam_csv(result)
    deliver("cam", [result.chapter()], json=json, out=out, title="Cam", files=files)
