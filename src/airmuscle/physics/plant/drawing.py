"""Drawing of a plant in the plane: outlines of the muscles, cables, pulley or load, at one row of a
recording.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ParameterError, select_prefix
from ...recording import Recording
from ..mechanism import AntagonisticJoint, Mechanism, PlanarArm
from ..mechanism.base import Translation
from ..mechanism.wrapper import MechanismWrapper
from ..muscle.geometry import Geometry

Row = Mapping[str, float]
"""Values of the columns of a recording at one time."""
POINTS = 121
"""Points of an outline."""
FITTING = 0.06
"""Length of a fitting in resting lengths (chosen)."""


class Shape(NamedTuple):
    """A closed polygon: points (N, 2) [m], and the gauge pressure [Pa] that colours it, or None."""

    points: Array
    pressure: float | None = None


class Drawing(NamedTuple):
    """What is drawn: polygons, lines (N, 2) [m], and circles (x, y, radius) [m]."""

    shapes: list[Shape]
    lines: list[Array]
    circles: list[tuple[float, float, float]]


def muscle_outline(geometry: Geometry, contraction: float) -> Array:
    """Closed outline (N, 2) [m] about the middle of a muscle, whose axis is vertical.

    The radius is that of the geometry. Where it does not end at the fittings, as that of a
    cylinder, the ends are rounded for the drawing.
    """
    low, high = geometry.contraction_range
    axial, radius = geometry.outline(min(max(contraction, low), high), POINTS)
    half = float(axial[-1])
    widest = float(radius.max())
    end = min(widest, half)
    rounding = np.sqrt(
        np.clip(1.0 - ((np.abs(axial) - (half - end)) / end).clip(0.0) ** 2, 0.0, None)
    )
    smallest = 0.45 * widest if radius[0] > 0.9 * widest else float(radius[0])
    radius = np.maximum(radius * rounding, smallest) if radius[0] > 0.9 * widest else radius
    right = np.column_stack([radius, axial])
    return np.vstack([right, right[::-1] * (-1.0, 1.0)])


class MuscleShapes:
    """The muscles of a plant along a run, with the space that they need."""

    def __init__(
        self, geometries: Sequence[Geometry], prefixes: Sequence[str], recording: Recording
    ) -> None:
        self.geometries = geometries
        self.prefixes = prefixes
        self.length = max(g.resting_length for g in geometries)
        self.fitting_radii = [0.5 * float(muscle_outline(g, 0.0)[:, 0].max()) for g in geometries]
        pressures, contractions = (
            [recording[f"{p}{quantity}"] for p in prefixes]
            for quantity in ("pressure", "contraction")
        )
        self.pressure = max(float(pressure.max(initial=0.0)) for pressure in pressures)
        """Maximum gauge pressure [Pa], 0 or more."""
        largest = zip(geometries, (float(c.max(initial=0.0)) for c in contractions), strict=True)
        widths = [
            float(muscle_outline(geometry, contraction)[:, 0].max())
            for geometry, contraction in largest
        ]
        self.spacing = 1.08 * max(widths)
        """Distance [m] of a muscle from the middle at which it does not touch another one."""

    def shapes(
        self, index: int, row: Row, x: float, y: float, upwards: float
    ) -> tuple[list[Shape], float]:
        """A muscle with both fittings, from y on upwards (1) or downwards (-1); its shapes and its
        other end.
        """
        geometry = self.geometries[index]
        radius = self.fitting_radii[index]
        muscle_row = select_prefix(self.prefixes[index], row)
        contraction = muscle_row["contraction"]
        fitting = FITTING * geometry.resting_length
        length = geometry.resting_length * (1.0 - contraction)
        middle = y + upwards * (fitting + length / 2)
        end = y + upwards * (2 * fitting + length)
        first = _box(x, radius, y, y + upwards * fitting)
        second = _box(x, radius, end - upwards * fitting, end)
        outline = muscle_outline(geometry, contraction) + np.array([x, middle])
        return [Shape(outline, muscle_row["pressure"]), first, second], end


class Scene(NamedTuple):
    """A plant that can be drawn.

    limits       left, right, lower and upper edge of the drawing [m]
    coordinates  columns by which the mechanism is drawn; the first is plotted beside it
    draw         function from one row to the drawing
    """

    muscles: MuscleShapes
    limits: tuple[float, float, float, float]
    coordinates: tuple[str, ...]
    draw: Callable[[Row], Drawing]


def _joint_scene(muscles: MuscleShapes, joint: AntagonisticJoint) -> Scene:
    """Two muscles side by side below a pulley, whose angle a pointer shows."""
    length = muscles.length
    radius = joint.radius
    base = -1.35 * length
    place = max(radius, muscles.spacing)
    half = max(0.62 * length, 2.05 * muscles.spacing)
    floor = _box(0.0, 0.5 * length, base - 0.03 * length, base)
    pulley = (0.0, 0.0, radius)

    def draw(row: Row) -> Drawing:
        shapes = [floor]
        lines = []
        for index, side in enumerate((-1.0, 1.0)):
            x = side * place
            muscle, top = muscles.shapes(index, row, x, base, 1.0)
            shapes += muscle
            cable = [[x, top], [side * radius, 0.0]]
            lines.append(np.array(cable))
        angle = row["angle"]
        direction = np.array([-np.sin(angle), np.cos(angle)])
        tip = 0.5 * length * direction
        lines.append(np.array([[0.0, 0.0], tip]))
        mark = (*tip.tolist(), 0.2 * radius)
        return Drawing(shapes, lines, [pulley, mark])

    limits = (-half, half, -1.45 * length, 0.62 * length)
    return Scene(muscles, limits, ("angle",), draw)


def _lift_scene(muscles: MuscleShapes, load: Translation) -> Scene:
    """A muscle that hangs from a ceiling, with the load below it."""
    length = muscles.length
    ceiling = _box(0.0, 0.3 * length, 0.0, 0.03 * length)
    width = 0.13 * length

    def draw(row: Row) -> Drawing:
        muscle, end = muscles.shapes(0, row, 0.0, 0.0, -1.0)
        top = end - 0.04 * length
        bottom = end - 0.2 * length
        mass = _box(0.0, width, bottom, top)
        cable = np.array([[0.0, end], [0.0, top]])
        shapes = [ceiling, *muscle, mass]
        return Drawing(shapes, [cable], [])

    limits = (-0.5 * length, 0.5 * length, -1.5 * length, 0.1 * length)
    return Scene(muscles, limits, ("position",), draw)


def _arm_scene(muscles: MuscleShapes, arm: PlanarArm) -> Scene:
    """The links of a planar arm, with its muscles side by side above them."""
    count = len(muscles.geometries)
    coordinates = tuple(c.name for c in arm.coordinates)
    lengths = [link.length for link in arm.links]
    reach = float(sum(lengths))
    half = max(1.1 * reach, 1.2 * muscles.spacing * count)
    shoulder = _box(0.0, 0.15 * reach, 0.03 * reach, 0.06 * reach)
    places = [2.2 * muscles.spacing * (index - 0.5 * (count - 1)) for index in range(count)]

    def draw(row: Row) -> Drawing:
        points = _joint_points(lengths, [row[name] for name in coordinates])
        shapes = [shoulder]
        for index, place in enumerate(places):
            muscle, _ = muscles.shapes(index, row, place, 0.15 * reach, 1.0)
            shapes += muscle
        joints = [(*point.tolist(), 0.03 * reach) for point in points]
        return Drawing(shapes, [points], joints)

    top = 0.25 * reach + 1.25 * muscles.length
    limits = (-half, half, -1.15 * reach, top)
    return Scene(muscles, limits, coordinates, draw)


def _joint_points(lengths: Sequence[float], angles: Sequence[float]) -> Array:
    """The shoulder and the ends of the links (N + 1, 2) [m] at the angles of the joints [rad]."""
    point = np.zeros(2)
    points = [point]
    for length, angle in zip(lengths, np.cumsum(angles), strict=True):
        direction = np.array([np.sin(angle), -np.cos(angle)])
        point = point + length * direction
        points.append(point)
    return np.vstack(points)


def scene_of(
    geometries: Sequence[Geometry],
    prefixes: Sequence[str],
    mechanism: Mechanism,
    recording: Recording,
) -> Scene:
    """The scene of a plant along a run. Raises ParameterError for a mechanism that is neither a
    joint of two muscles, a planar arm nor a translation by one muscle."""
    inner: Any = mechanism
    while isinstance(inner, MechanismWrapper):
        inner = inner.inner
    scenes: dict[type, Callable[[MuscleShapes, Any], Scene]] = {
        AntagonisticJoint: _joint_scene,
        PlanarArm: _arm_scene,
    }
    if len(geometries) == 1:
        scenes[Translation] = _lift_scene
    for kind, scene in scenes.items():
        if isinstance(inner, kind):
            return scene(MuscleShapes(geometries, prefixes, recording), inner)
    raise ParameterError(
        f"animate: {type(inner).__name__} with {len(geometries)} muscles cannot be drawn; possible"
        " are an AntagonisticJoint, a PlanarArm, and a load on one muscle (HangingMass,"
        " SpringLoad). recording.plot() plots any columns."
    )


def _box(x: float, half_width: float, lower: float, upper: float) -> Shape:
    left = x - half_width
    right = x + half_width
    return Shape(np.array([[left, lower], [right, lower], [right, upper], [left, upper]]))
