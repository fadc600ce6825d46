"""Drawing of a plant in the plane: outlines of the muscles, cables, pulley or load, at one row of a recording."""

import abc
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ParameterError, select_prefix
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

    The radius is that of the geometry. Where it does not end at the fittings, as that of a cylinder, the ends are
    rounded for the drawing.
    """
    low, high = geometry.contraction_range
    axial, radius = geometry.outline(min(max(contraction, low), high), POINTS)
    half, widest = float(axial[-1]), float(radius.max())
    end = min(widest, half)
    rounding = np.sqrt(np.clip(1.0 - ((np.abs(axial) - (half - end)) / end).clip(0.0) ** 2, 0.0, None))
    smallest = 0.45 * widest if radius[0] > 0.9 * widest else float(radius[0])
    radius = np.maximum(radius * rounding, smallest) if radius[0] > 0.9 * widest else radius
    right = np.column_stack([radius, axial])
    return np.vstack([right, right[::-1] * (-1.0, 1.0)])


class Scene(abc.ABC):
    """A plant that can be drawn (interface)."""

    def __init__(self, geometries: Sequence[Geometry], prefixes: Sequence[str], mechanism: Any) -> None:
        self.geometries, self.prefixes, self.mechanism = tuple(geometries), tuple(prefixes), mechanism
        self.length = max(g.resting_length for g in self.geometries)
        self.fitting_radii = [0.5 * float(muscle_outline(g, 0.0)[:, 0].max()) for g in self.geometries]
        self.spacing = 0.0
        """Distance [m] of a muscle from the middle at which it does not touch another one."""

    def make_room(self, contractions: Sequence[float]) -> None:
        """Set the spacing for the maximum contraction of each muscle."""
        widths = [
            float(muscle_outline(g, max(c, 0.0))[:, 0].max())
            for g, c in zip(self.geometries, contractions, strict=True)
        ]
        self.spacing = 1.08 * max(widths)

    @property
    @abc.abstractmethod
    def limits(self) -> tuple[float, float, float, float]:
        """Left, right, lower and upper edge of the drawing [m]."""

    @property
    @abc.abstractmethod
    def coordinate(self) -> str:
        """The column that is plotted beside the drawing."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The columns by which the mechanism is drawn."""
        return (self.coordinate,)

    @abc.abstractmethod
    def draw(self, row: Row) -> Drawing:
        """The drawing at one row."""

    def _muscle(self, index: int, row: Row, x: float, y: float, upwards: float) -> tuple[list[Shape], float]:
        """A muscle with both fittings, from y on upwards (1) or downwards (-1); its shapes and its other end."""
        geometry, own = self.geometries[index], select_prefix(self.prefixes[index], row)
        fitting = FITTING * geometry.resting_length
        length = geometry.resting_length * (1.0 - own["contraction"])
        outline = muscle_outline(geometry, own["contraction"])
        middle = y + upwards * (fitting + length / 2)
        end = y + upwards * (2 * fitting + length)
        ends = [(y, y + upwards * fitting), (end - upwards * fitting, end)]
        boxes = [Shape(_box(x, self.fitting_radii[index], *pair)) for pair in ends]
        return [Shape(outline + np.array([x, middle]), own["pressure"]), *boxes], end


class JointScene(Scene):
    """Two muscles side by side below a pulley, whose angle a pointer shows."""

    mechanism: AntagonisticJoint
    coordinate = "angle"

    @property
    def limits(self) -> tuple[float, float, float, float]:
        half = max(0.62 * self.length, 2.05 * self.spacing)
        return -half, half, -1.45 * self.length, 0.62 * self.length

    def draw(self, row: Row) -> Drawing:
        base, radius, angle = -1.35 * self.length, self.mechanism.radius, row["angle"]
        shapes, lines = [Shape(_box(0.0, 0.5 * self.length, base - 0.03 * self.length, base))], []
        place = max(radius, self.spacing)
        for index, side in enumerate((-1.0, 1.0)):
            muscle, top = self._muscle(index, row, side * place, base, 1.0)
            shapes += muscle
            lines.append(np.array([[side * place, top], [side * radius, 0.0]]))
        tip = 0.5 * self.length * np.array([-np.sin(angle), np.cos(angle)])
        lines.append(np.array([[0.0, 0.0], tip]))
        return Drawing(shapes, lines, [(0.0, 0.0, radius), (*tip.tolist(), 0.2 * radius)])


class LiftScene(Scene):
    """A muscle that hangs from a ceiling, with the load below it."""

    coordinate = "position"

    @property
    def limits(self) -> tuple[float, float, float, float]:
        return -0.5 * self.length, 0.5 * self.length, -1.5 * self.length, 0.1 * self.length

    def draw(self, row: Row) -> Drawing:
        ceiling = Shape(_box(0.0, 0.3 * self.length, 0.0, 0.03 * self.length))
        muscle, end = self._muscle(0, row, 0.0, 0.0, -1.0)
        load = Shape(_box(0.0, 0.13 * self.length, end - 0.2 * self.length, end - 0.04 * self.length))
        cable = np.array([[0.0, end], [0.0, end - 0.04 * self.length]])
        return Drawing([ceiling, *muscle, load], [cable], [])


class ArmScene(Scene):
    """The links of a planar arm, with its muscles side by side above them."""

    mechanism: PlanarArm

    @property
    def reach(self) -> float:
        """The length of the arm [m]."""
        return float(sum(link.length for link in self.mechanism.links))

    @property
    def limits(self) -> tuple[float, float, float, float]:
        half = max(1.1 * self.reach, 1.2 * self.spacing * len(self.geometries))
        return -half, half, -1.15 * self.reach, 0.25 * self.reach + 1.25 * self.length

    @property
    def coordinate(self) -> str:
        return self.coordinates[0]

    @property
    def coordinates(self) -> tuple[str, ...]:
        return tuple(c.name for c in self.mechanism.coordinates)

    def draw(self, row: Row) -> Drawing:
        angles = np.cumsum([row[name] for name in self.coordinates])
        steps = [
            link.length * np.array([np.sin(a), -np.cos(a)])
            for link, a in zip(self.mechanism.links, angles, strict=True)
        ]
        points = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
        shapes = [Shape(_box(0.0, 0.15 * self.reach, 0.03 * self.reach, 0.06 * self.reach))]
        for index in range(len(self.geometries)):
            place = 2.2 * self.spacing * (index - 0.5 * (len(self.geometries) - 1))
            shapes += self._muscle(index, row, place, 0.15 * self.reach, 1.0)[0]
        return Drawing(shapes, [points], [(*point.tolist(), 0.03 * self.reach) for point in points])


def scene_of(geometries: Sequence[Geometry], prefixes: Sequence[str], mechanism: Mechanism) -> Scene:
    """The scene of a plant. Raises ParameterError for a mechanism that is neither a joint of two muscles, a planar arm
    nor a translation by one muscle."""
    inner: Mechanism = mechanism
    while isinstance(inner, MechanismWrapper):
        inner = inner.inner
    if isinstance(inner, AntagonisticJoint):
        return JointScene(geometries, prefixes, inner)
    if isinstance(inner, PlanarArm):
        return ArmScene(geometries, prefixes, inner)
    if isinstance(inner, Translation) and len(geometries) == 1:
        return LiftScene(geometries, prefixes, inner)
    raise ParameterError(
        f"animate: {type(inner).__name__} with {len(geometries)} muscles cannot be drawn; possible are an "
        "AntagonisticJoint, a PlanarArm, and a load on one muscle (HangingMass, SpringLoad). "
        "recording.plot() plots any columns."
    )


def _box(x: float, half_width: float, lower: float, upper: float) -> Array:
    return np.array(
        [[x - half_width, lower], [x + half_width, lower], [x + half_width, upper], [x - half_width, upper]]
    )
