"""Request of a cam: torque over an angle, muscle, pressure, and limits of the outline."""

import math
from pathlib import Path
from typing import Any

from ...core import quantity
from ...design.cam import Cam, CamCurve, design_cam, linear_curve, read_cam_curve
from ...files.library import load_law
from .declaration import RequestError, Where, option, optional, request


def read_angles(text: str, where: str) -> tuple[float, float]:
    """A range of angles [rad] of a text such as '0 deg..60 deg'. Raises InputError."""
    low, separator, high = text.partition("..")
    if not separator:
        raise RequestError(f"{where} is '{text}'; give two angles: '0 deg..60 deg'.")
    return quantity(low.strip(), "rad", where=where), quantity(high.strip(), "rad", where=where)


@request
class CamRequest:
    """What a cam is asked for."""

    pressure: float = option("Pressure of the muscle: '4 bar' (gauge).", unit="Pa")
    curve: Path | None = optional(
        "CSV file of the torque: angle [deg], torque [N m].", metavar="FILE"
    )
    torque: float | None = optional("Torque in the middle of the range: '10 N m'.", unit="N m")
    stiffness: float = option(
        "Constant stiffness by which the torque falls: '4 N m/rad'.",
        unit="N m/rad",
        default="0 N m/rad",
    )
    angle: Any = optional(
        "Range of the angle: '0 deg..90 deg'.", metavar="LOW..HIGH", read=read_angles
    )
    length: float | None = optional(
        "Nominal length; by default one of whose work the curve takes 85 %.", unit="m"
    )
    distance: float | None = optional(
        "Distance from the axis of the point from which the cable comes; parallel without.",
        unit="m",
    )
    least_radius: float = option(
        "Least radius of curvature of the outline.", unit="m", default="0 mm"
    )
    hub: float | None = optional(
        "Radius of the hub; by default half the least moment arm.", unit="m"
    )

    def check(self, where: Where) -> None:
        """Refuse no curve, and two."""
        if self.curve is None and (self.torque is None or self.angle is None):
            raise RequestError(
                f"give the torque with {where('curve')}, or with {where('torque')} and"
                f" {where('angle')}."
            )
        if self.curve is not None and (self.torque is not None or self.angle is not None):
            raise RequestError(
                f"{where('curve')} and {where('torque')} or {where('angle')} exclude each other."
            )

    def demanded(self) -> CamCurve:
        """The torque over the angle. Raises FileError and ParameterError."""
        if self.curve is not None:
            return read_cam_curve(self.curve)
        assert self.torque is not None
        assert self.angle is not None
        low, high = self.angle
        return linear_curve(low, high, self.torque, self.stiffness)

    def cam(self, muscle: str) -> Cam:
        """The cam of a muscle. Raises FileError, ParameterError and SolveError."""
        return design_cam(
            self.demanded(),
            load_law(muscle),
            self.pressure,
            length=self.length,
            distance=math.inf if self.distance is None else self.distance,
            least_radius=self.least_radius,
            hub=self.hub,
        )
