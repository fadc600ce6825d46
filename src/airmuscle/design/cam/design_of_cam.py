"""Design of a cam: the profile on which a muscle at a pressure gives a torque over the angle.

The work of the muscle is that of the torque, from the least angle on:

    int_0^s F(p, eps_0 + s'/L0) ds' = int tau dtheta,    r(theta) = ds/dtheta = tau/F

s shortening, r moment arm. The moment arm is the support function of the outline: at the angle phi
of its normal in the frame of the cam the cable is a tangent at the distance h(phi) = r. The outline
is h n + h' t; its radius of curvature h + h'' must not be negative, else the cable leaves it.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Array, FileError, ParameterError, SolveError
from ...files.library import Entry
from ..body.poses import factor_of, named_heading, numbers_of, read_table_of_numbers
from ..sizing import SizingConditions, StaticMuscle, working_muscle
from ..sizing.static_muscle import at_length, length_range
from .cam import Cam, CamCurve, CamOutline

ANGLES = 721
"""Angles of a profile (chosen)."""
CONTRACTIONS = 401
"""Contractions at which the work of a muscle is evaluated (chosen)."""
USED_WORK = 0.85
"""Part of the work of which a muscle of the chosen length is capable that a curve takes (chosen):
the last of its contraction has little force, and would need great moment arms."""
HUB = 0.5
"""Radius of the hub over the least moment arm, where none is stated (chosen)."""
HUB_POINTS = 181
"""Points of the hub in the outline (chosen)."""
NEWTON_STEPS = 8
"""Steps of the inversion of the work; they reach rounding precision."""


class _Shape(NamedTuple):
    """Angle of the normal [rad], radius of curvature [m] and outline [m] (N, 2) of a profile."""

    normal: Array
    curvature: Array
    points: Array


def linear_curve(low: float, high: float, torque: float, stiffness: float = 0.0) -> CamCurve:
    """A torque that falls by a constant stiffness [N m/rad], tau = tau_m - K (theta - theta_m),
    with `torque` [N m] in the middle of the range [rad]. Raises ParameterError.
    """
    if not low < high:
        raise ParameterError(
            f"the range of the angle is {math.degrees(low):.4g} to {math.degrees(high):.4g} deg;"
            " the first must be less."
        )
    middle = 0.5 * (low + high)
    name = f"torque of {torque:.4g} N m"
    if stiffness:
        name += f" with a stiffness of {stiffness:.4g} N m/rad"
    return CamCurve(name, low, high, lambda angle: torque - stiffness * (angle - middle))


def read_cam_curve(path: Path) -> CamCurve:
    """The curve of a CSV file with the columns 'angle [deg]' and 'torque [N m]'; between its rows a
    cubic spline, whose curvature is continuous. Raises FileError.
    """
    from scipy.interpolate import CubicSpline

    heading, *lines = read_table_of_numbers(path)
    headings = [
        named_heading(text, f"{path}: heading {number}") for number, text in enumerate(heading, 1)
    ]
    names = [name for name, _ in headings]
    if sorted(names) != ["angle", "torque"]:
        raise FileError(
            f"{path}: its columns are {', '.join(names)}; a curve of a cam has angle [deg] and"
            " torque [N m]."
        )
    values = numbers_of(path, lines, 2)
    columns = {}
    for place, (name, unit) in enumerate(headings):
        target = "rad" if name == "angle" else "N m"
        factor = factor_of(unit or target, target, f"{path}: column {name}")
        columns[name] = factor * values[:, place]
    order = np.argsort(columns["angle"])
    angle = columns["angle"][order]
    if len(angle) < 3 or not (np.diff(angle) > 0.0).all():
        raise FileError(f"{path}: a curve needs at least three rows with different angles.")
    spline = CubicSpline(angle, columns["torque"][order])
    return CamCurve(
        f"torque of {path.name}",
        float(angle[0]),
        float(angle[-1]),
        lambda position: np.asarray(spline(position)),
    )


def design_cam(
    curve: CamCurve,
    entry: Entry,
    pressure: float,
    *,
    length: float | None = None,
    distance: float = math.inf,
    least_radius: float = 0.0,
    hub: float | None = None,
) -> Cam:
    """The cam on which a muscle gives a curve of torque.

    curve         torque [N m] over the angle [rad]; greater than 0, towards greater angles
    entry         the muscle
    pressure      gauge pressure [Pa]
    length        nominal length [m]; by default one whose work the curve takes to 85 % (chosen)
    distance      distance [m] from the axis of the point from which the cable comes; infinite for a
                  cable that stays parallel
    least_radius  least radius of curvature of the outline [m]
    hub           radius of the hub [m]; half the least moment arm by default (chosen)

    Raises SolveError where the muscle has too little work, or the outline would not be convex, and
    ParameterError.
    """
    angle = np.linspace(curve.low, curve.high, ANGLES)
    torque = np.asarray(curve.torque(angle), float)
    if not (torque > 0.0).all():
        row = int(np.argmin(torque))
        raise ParameterError(
            f"the torque is {torque[row]:.4g} N m at {np.degrees(angle[row]):.4g}°; it must be"
            " greater than 0 over the whole range, because a muscle only pulls. Shorten the range,"
            " or reduce the stiffness."
        )
    conditions = SizingConditions(pressure, min_pressure=min(1e4, 0.5 * pressure))
    chosen = _length(entry, conditions, torque, angle) if length is None else length
    muscle = working_muscle(at_length(entry, chosen), conditions)
    if muscle.pressure_range[1] < pressure:
        raise ParameterError(
            f"{entry.name}: its law is valid up to {muscle.pressure_range[1] / 1e5:.4g} bar; the"
            f" pressure is {pressure / 1e5:.4g} bar."
        )
    contraction, force = _forces(muscle, pressure)
    if force.max() > muscle.max_force * (1.0 + 1e-9):
        raise ParameterError(
            f"{entry.name}: its force at {pressure / 1e5:.4g} bar is {force.max():.4g} N; its maker"
            f" permits {muscle.max_force:.4g} N. Reduce the pressure."
        )
    shortening = _shortening(entry.name, chosen, contraction, force, _work(angle, torque))
    taken = contraction[0] + shortening / chosen
    pull = np.asarray(muscle.force(pressure, taken), float)
    arm = torque / pull
    if not arm.max() < distance:
        raise ParameterError(
            f"the cable comes from {1e3 * distance:.4g} mm; it must be more than the greatest"
            f" moment arm, {1e3 * arm.max():.4g} mm."
        )
    shape = _shape(angle, arm, distance)
    _check_convex(angle, shape.curvature, least_radius)
    radius = HUB * float(arm.min()) if hub is None else hub
    if not 0.0 < radius <= float(arm.min()):
        raise ParameterError(
            f"the hub is {1e3 * radius:.4g} mm; allowed range: greater than 0 to the least moment"
            f" arm, {1e3 * arm.min():.4g} mm."
        )
    outline = CamOutline(shape.points, _hull(shape.points, radius))
    return Cam(
        curve,
        muscle,
        chosen,
        pressure,
        distance,
        angle,
        arm,
        shortening,
        taken,
        pull,
        shape.normal,
        shape.curvature,
        outline,
        radius,
    )


def _forces(muscle: StaticMuscle, pressure: float) -> tuple[Array, Array]:
    """Contractions [1] from the least, at least 0, up to that without force, and the forces [N]
    there, (N,) each.
    """
    low, high = muscle.contraction_range
    contraction = np.linspace(max(low, 0.0), high, CONTRACTIONS)
    force = np.asarray(muscle.force(pressure, contraction), float)
    pulls = force > 0.0
    end = len(pulls) if pulls.all() else int(np.argmin(pulls))
    return contraction[:end], force[:end]


def _work(angle: Array, torque: Array) -> Array:
    """Work [J] of a torque from the first angle on (N,)."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(angle, torque).antiderivative()(angle))


def _length(entry: Entry, conditions: SizingConditions, torque: Array, angle: Array) -> float:
    """A nominal length [m] whose work the curve takes to the chosen part."""
    low, high = length_range(entry, conditions.max_length)
    needed = float(_work(angle, torque)[-1]) / USED_WORK
    length = high
    for _ in range(3):  # a law that depends on its length
        muscle = working_muscle(at_length(entry, length), conditions)
        contraction, force = _forces(muscle, conditions.supply)
        per_length = float(_work(contraction, force)[-1])
        length = min(max(needed / per_length, low), high)
    return length


def _shortening(
    name: str, length: float, contraction: Array, force: Array, demanded: Array
) -> Array:
    """Shortening [m] at which the muscle has done a work [J] (N,). Raises SolveError."""
    from scipy.interpolate import CubicSpline

    way = length * (contraction - contraction[0])
    spline = CubicSpline(way, force)
    work = spline.antiderivative()
    available = float(work(way[-1]))
    if demanded[-1] >= available:
        serving = length * float(demanded[-1]) / (USED_WORK * available)
        raise SolveError(
            f"{name}: a muscle of {1e3 * length:.4g} mm does {available:.4g} J at this pressure"
            f" from its least contraction until it is slack; the curve takes {demanded[-1]:.4g} J."
            f" A length of {1e3 * serving:.4g} mm would serve, or a higher pressure, or a smaller"
            " range of angles."
        )
    shortening = np.interp(demanded, work(way), way)
    for _ in range(NEWTON_STEPS):
        shortening = shortening - (work(shortening) - demanded) / spline(shortening)
        shortening = np.clip(shortening, 0.0, way[-1])
    return np.asarray(shortening)


def _shape(angle: Array, arm: Array, distance: float) -> _Shape:
    """The outline of which the moment arm is the distance of the tangent."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(angle, arm)
    normal = -0.5 * np.pi - angle + np.arcsin(arm / distance)
    turning = CubicSpline(angle, normal)
    if not (turning(angle, 1) < 0.0).all():
        row = int(np.argmax(turning(angle, 1)))
        raise SolveError(
            f"at {np.degrees(angle[row]):.4g}° the moment arm grows so fast that the cable turns"
            " with the cam; give a greater distance of the point from which the cable comes."
        )
    slope = spline(angle, 1) / turning(angle, 1)
    bend = CubicSpline(angle, slope)(angle, 1) / turning(angle, 1)
    across = np.stack([np.cos(normal), np.sin(normal)], axis=1)
    along = np.stack([-np.sin(normal), np.cos(normal)], axis=1)
    points = arm[:, None] * across + slope[:, None] * along
    return _Shape(normal, arm + bend, points)


def _check_convex(angle: Array, curvature: Array, least_radius: float) -> None:
    """Raise SolveError where the radius of curvature is less than permitted."""
    if curvature.min() >= least_radius:
        return
    wrong = angle[curvature < least_radius]
    raise SolveError(
        f"from {np.degrees(wrong[0]):.4g}° to {np.degrees(wrong[-1]):.4g}° the radius of curvature"
        f" of the outline, h + h'', falls to {1e3 * curvature.min():.4g} mm; it must be at least"
        f" {1e3 * least_radius:.4g} mm, else the cable leaves the cam or is bent too much. A lower"
        " pressure or a longer muscle gives greater moment arms; a curve that changes less gives a"
        " smaller h''."
    )


def _hull(points: Array, hub: float) -> Array:
    """Convex outline around the working part and the hub, counter-clockwise (M, 2)."""
    from scipy.spatial import ConvexHull

    around = np.linspace(0.0, 2.0 * np.pi, HUB_POINTS)[:-1]
    circle = hub * np.stack([np.cos(around), np.sin(around)], axis=1)
    everything = np.concatenate([points, circle])
    return np.asarray(everything[ConvexHull(everything).vertices])
