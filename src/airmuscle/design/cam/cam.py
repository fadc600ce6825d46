"""Cam: a pulley of variable radius on a joint, whose muscle gives a torque over the angle."""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...bench.reported import Reported
from ...core import Array, ShortRepr, plotting
from ...physics.mechanism import MuscleRoute, PolynomialProfile
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from ..sizing import StaticMuscle

GREATEST_RATIO = 100.0
"""Greatest coefficient that a polynomial profile may have."""
MOST_DEGREE = 12
FITTED = 1e-4
"""Greatest degree of the polynomial of a moment arm that enters a plant, and the relative error at
which a lower one suffices (chosen)."""
SHOWN_ROWS = 20
"""Rows of the profile that a page shows (chosen)."""
CABLE = 2.0
"""Length of the cable in the picture, over the greatest moment arm (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CamCurve(ShortRepr):
    """Torque over the angle of a joint that a muscle must give.

    name        what states it
    low, high   range of the angle [rad]
    torque      function of angles [rad] (N,) that returns torques [N m]
    """

    name: str
    low: float
    high: float
    torque: Callable[[Array], Array]


class CamOutline(NamedTuple):
    """Outline of a cam in its own frame, whose origin is the axis of the joint.

    working  points that the cable touches [m] (N, 2), from the least to the greatest angle; the
             last one is the anchor of the cable
    closed   all points of the convex outline (M, 2), counter-clockwise
    """

    working: Array
    closed: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Cam(Reported):
    """A cam for a curve of torque.

    The cable comes from a point at a distance on the x axis of the fixed frame, or parallel to it,
    and touches the cam below the axis of the joint; the cam turns with the angle.

    curve        torque over the angle
    muscle       the muscle, at its nominal length
    length       nominal length [m]
    pressure     gauge pressure [Pa]
    distance     distance of the point from which the cable comes from the axis [m]; infinite for a
                 parallel cable
    angle        angles [rad] (N,)
    arm          moment arms r [m] (N,)
    shortening   shortening of the muscle from the least angle [m] (N,)
    contraction  contractions [1] (N,)
    force        forces [N] (N,)
    normal       angle of the normal of the cable in the frame of the cam [rad] (N,)
    curvature    radius of curvature h + h'' of the outline [m] (N,), h(phi) the support function
    outline      the outline
    hub          radius of the hub about the axis [m]
    """

    curve: CamCurve
    muscle: StaticMuscle
    length: float
    pressure: float
    distance: float
    angle: Array
    arm: Array
    shortening: Array
    contraction: Array
    force: Array
    normal: Array
    curvature: Array
    outline: CamOutline
    hub: float

    @property
    def torque(self) -> Array:
        """Torques [N m] that the muscle gives at the angles (N,)."""
        return np.asarray(self.arm * self.force)

    @property
    def middle(self) -> float:
        """Middle of the range of the angle [rad], at which the joint of `route` has the angle 0."""
        return 0.5 * (self.curve.low + self.curve.high)

    def route(self) -> MuscleRoute:
        """The cam as the route of a muscle over a joint, whose angle is measured from the middle of
        the range; a polynomial of the moment arm.
        """
        half = 0.5 * (self.curve.high - self.curve.low)
        scaled = (self.angle - self.middle) / half
        exponents = np.arange(1, MOST_DEGREE + 1)
        radius = float(np.interp(self.middle, self.angle, self.arm))
        ratios = np.zeros(1)
        least = np.inf
        for degree in exponents:
            series = np.polynomial.Chebyshev.fit(scaled, self.arm, degree, domain=[-1.0, 1.0])
            error = float(np.max(np.abs(series(scaled) / self.arm - 1.0)))
            powers = series.convert(kind=np.polynomial.Polynomial).coef
            candidate = powers[1:] / (powers[0] * half ** exponents[:degree])
            if error < least and np.abs(candidate).max() <= GREATEST_RATIO:
                least = error
                radius = float(powers[0])
                ratios = candidate
            if least <= FITTED:
                break
        at_middle = float(np.interp(self.middle, self.angle, self.contraction))
        profile = PolynomialProfile(tuple(map(float, ratios)))
        return MuscleRoute((1,), (radius,), at_middle, (profile,))

    def round_torque(self) -> Array:
        """Torques [N m] with a round pulley of the same shortening (N,)."""
        way = self.angle - self.angle[0]
        radius = self.shortening[-1] / way[-1]
        contraction = self.contraction[0] + radius * way / self.length
        force = self.muscle.force(self.pressure, contraction)
        return np.asarray(radius * force)

    def chapter(self) -> Chapter:
        """The description of the cam."""
        name = self.muscle.entry.name
        summary = (
            f"A {name} of {1e3 * self.length:.4g} mm at {self.pressure / 1e5:.4g} bar gives the"
            f" {self.curve.name} from {np.degrees(self.curve.low):.4g}° to"
            f" {np.degrees(self.curve.high):.4g}° on a cam with moment arms of"
            f" {1e3 * self.arm.min():.4g} to {1e3 * self.arm.max():.4g} mm; it contracts from"
            f" {100 * self.contraction[0]:.3g} to {100 * self.contraction[-1]:.3g} %. The outline"
            f" is convex, with radii of curvature of at least {1e3 * self.curvature.min():.4g} mm,"
            " so that the cable lies on it."
        )
        rows = slice(None, None, max(1, (len(self.angle) - 1) // SHOWN_ROWS))
        columns: dict[str, Any] = {
            "angle": TableColumn(np.degrees(self.angle[rows]), "deg"),
            "torque": TableColumn(self.torque[rows], "N m"),
            "moment arm": TableColumn(self.arm[rows], "m", "mm"),
            "shortening": TableColumn(self.shortening[rows], "m", "mm"),
            "contraction": TableColumn(self.contraction[rows], "1", "%", 3),
            "force": TableColumn(self.force[rows], "N"),
            "radius of curvature": TableColumn(self.curvature[rows], "m", "mm"),
        }
        return Chapter(
            "cam",
            f"Cam for {name}",
            summary,
            values=(
                NamedValue("nominal length", self.length, "m", "mm"),
                NamedValue("least moment arm", float(self.arm.min()), "m", "mm"),
                NamedValue("greatest moment arm", float(self.arm.max()), "m", "mm"),
                NamedValue("least radius of curvature", float(self.curvature.min()), "m", "mm"),
                NamedValue("shortening", float(self.shortening[-1]), "m", "mm"),
            ),
            tables=(Table("profile", "Profile of the cam", columns),),
            plots=(
                Plot(
                    "cam",
                    "The cam with its cable at the least, middle and greatest angle.",
                    functools.partial(cam_figure, self),
                ),
                Plot(
                    "torque",
                    "Torque over the angle, with the cam and with a round pulley of the same"
                    " shortening.",
                    functools.partial(torque_figure, self),
                ),
            ),
            chosen=(("radius of the hub", f"{1e3 * self.hub:.4g} mm", "given or chosen"),),
        )


def cam_figure(cam: Cam) -> Any:
    """The outline at the least, middle and greatest angle, with the cable, all at one scale."""
    figure, every = plotting.new_figure(columns=3, width=9.0, height=3.6, sharey=True)
    last = len(cam.angle) - 1
    rows = (0, last // 2, last)
    sizes = np.linalg.norm(cam.outline.closed, axis=1)
    reach = 1e3 * float(sizes.max())
    for axes, row in zip(every, rows, strict=True):
        _draw_cam(axes, cam, row)
        axes.set_aspect("equal")
        axes.set_xlim(-1.1 * reach, 1.6 * reach)
        axes.set_ylim(-1.1 * reach, 1.1 * reach)
    return figure


def _draw_cam(axes: Any, cam: Cam, row: int) -> None:
    """The cam and its cable at one angle."""
    angle = float(cam.angle[row])
    closed = _turned(cam.outline.closed, angle)
    _draw_line(axes, np.append(closed, closed[:1], axis=0), plotting.BLACK)
    touched = cam.outline.working[row:]
    wrapped = _turned(touched, angle)
    end = wrapped[0] + _free_part(cam, row)
    cable = np.insert(wrapped, 0, end, axis=0)
    _draw_line(axes, cable, plotting.BLUE, linewidth=2.5)
    anchor = wrapped[-1:]
    _draw_line(axes, anchor, plotting.RED, marker="o")
    axis = np.zeros((1, 2))
    _draw_line(axes, axis, plotting.BLACK, marker="+")
    degrees = np.degrees(angle) + 0.0
    arm = 1e3 * float(cam.arm[row])
    axes.set_title(f"{degrees:.3g}°, r = {arm:.3g} mm")
    axes.set_xlabel("mm")


def _turned(points: Array, angle: float) -> Array:
    """Points (N, 2) of the cam in the fixed frame."""
    cosine = np.cos(angle)
    sine = np.sin(angle)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    return np.asarray(points @ turn)


def _free_part(cam: Cam, row: int) -> Array:
    """The shown part of the free cable [m] (2,), from the cam on."""
    normal = cam.normal[row] + cam.angle[row]
    direction = normal + 0.5 * np.pi
    cosine = np.cos(direction)
    sine = np.sin(direction)
    shown = CABLE * float(cam.arm.max())
    reach = min(shown, 0.9 * cam.distance)
    return np.array([reach * cosine, reach * sine])


def _draw_line(axes: Any, points: Array, colour: str, **style: Any) -> None:
    """Points [m] (N, 2) as a line in mm."""
    x, y = 1e3 * points.T
    axes.plot(x, y, color=colour, **style)


def torque_figure(cam: Cam) -> Any:
    """Torque over the angle."""
    figure, axes = plotting.new_figure()
    degrees = np.degrees(cam.angle)
    axes.plot(degrees, cam.curve.torque(cam.angle), color=plotting.BLACK, label="demanded")
    axes.plot(degrees, cam.torque, "--", color=plotting.BLUE, label="with the cam")
    axes.plot(degrees, cam.round_torque(), ":", color=plotting.ORANGE, label="round pulley")
    axes.set_xlabel("angle in degrees")
    axes.set_ylabel("torque in N m")
    plotting.legend_outside(axes)
    return figure
