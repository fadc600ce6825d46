"""Drawing of a choice with its dimensions in millimetres: the muscles of a lift or a gripper at
both ends of their travel, or the pair of a joint on its pulley.
"""

from typing import Any, NamedTuple

import numpy as np

from ...core import Array, plotting
from .requirement_and_choice import GripperRequirement, LiftRequirement, MuscleChoice
from .static_muscle import EndPoint

MUSCLE = "#DCE6EE"
METAL = "#9AA3AB"
GAP = 0.15
"""Distance between muscles side by side, relative to their diameter (chosen)."""
FITTING = 0.5
"""Length of an end fitting in the drawing, relative to the nominal diameter (chosen)."""
LINE = 0.8
THIN = 0.5
FONT = 7.0


class Span(NamedTuple):
    """Two ends of a dimension on one axis [mm]."""

    low: float
    high: float


class Scale(NamedTuple):
    """Sizes of a drawing [mm]: diameter of a muscle at pressure, its greatest length, and the unit
    of distances between lines.
    """

    diameter: float
    length: float
    unit: float


def draw_arrangement(axes: Any, choice: MuscleChoice) -> None:
    """Draw a choice with a geometry to scale into empty axes."""
    axes.set_aspect("equal")
    axes.set_axis_off()
    scale = _scale(choice)
    if choice.design.radius is None:
        _draw_pull(axes, choice, scale)
    else:
        _draw_joint(axes, choice, scale, 1e3 * choice.design.radius)
    axes.margins(x=0.10, y=0.09)


def _scale(choice: MuscleChoice) -> Scale:
    length = 1e3 * choice.length * (1.0 - choice.design.extended.contraction)
    diameter = 1e3 * (choice.diameter or 0.0)
    return Scale(diameter, length, 0.03 * max(length, 3.0 * diameter))


def _outline(choice: MuscleChoice, point: EndPoint) -> tuple[Array, Array]:
    """Positions from the upper end downwards and radii of a muscle [mm]."""
    geometry = choice.entry.geometry
    assert geometry is not None
    position, radius = geometry.outline(point.contraction)
    return 1e3 * (position.max() - position), 1e3 * np.asarray(radius)


def _draw_muscle(axes: Any, choice: MuscleChoice, point: EndPoint, x: float, top: float) -> float:
    """Draw a muscle that hangs from `top` at x; return the height of its lower end [mm]."""
    from matplotlib.patches import Polygon, Rectangle

    down, radius = _outline(choice, point)
    nominal = 1e3 * _nominal_diameter(choice)
    height = FITTING * nominal
    edge = np.concatenate([x - radius, (x + radius)[::-1]])
    rows = np.concatenate([top - down, (top - down)[::-1]])
    outline = np.column_stack([edge, rows])
    axes.add_patch(
        Polygon(outline, facecolor=MUSCLE, edgecolor=plotting.BLACK, linewidth=LINE),
    )
    low = top - float(down.max())
    for bottom in (top, low - height):
        corner = (x - 0.5 * nominal, bottom)
        axes.add_patch(
            Rectangle(corner, nominal, height, facecolor=METAL, edgecolor="black", linewidth=LINE)
        )
    axes.plot(
        [x, x],
        [top + 1.6 * height, low - 1.6 * height],
        "-.",
        color="0.4",
        linewidth=THIN,
    )
    return low


def _nominal_diameter(choice: MuscleChoice) -> float:
    """Nominal diameter [m], or that of the geometry at rest."""
    ratings = choice.entry.ratings
    if ratings is not None and ratings.diameter > 0.0:
        return ratings.diameter
    return choice.muscle.diameter(0.0) or 0.0


class DrawnPlace(NamedTuple):
    """Place of the muscles in one state of a drawing [mm]: middle and width of all, distance
    between two.
    """

    middle: float
    width: float
    pitch: float

    @property
    def left(self) -> float:
        """The edge of the first muscle."""
        return self.middle - 0.5 * self.width

    @property
    def right(self) -> float:
        """The edge of the last muscle."""
        return self.middle + 0.5 * self.width


def _draw_pull(axes: Any, choice: MuscleChoice, scale: Scale) -> None:
    """The muscles at the start and at the end of their travel, side by side, with their load."""
    pitch = (1.0 + GAP) * scale.diameter
    width = pitch * (choice.count - 1) + scale.diameter
    distance = max(5.0 * scale.unit + scale.diameter, 0.3 * scale.length)
    start = DrawnPlace(0.0, width, pitch)
    end = DrawnPlace(width + distance, width, pitch)
    start_low = _draw_state(axes, choice, choice.design.extended, start, scale)
    end_low = _draw_state(axes, choice, choice.design.contracted, end, scale)
    height = _fitting(choice) + 2.2 * scale.unit
    axes.text(
        start.middle,
        height,
        _each_text("start", choice.design.extended),
        **_LABEL,
    )
    axes.text(
        end.middle,
        height,
        _each_text("end", choice.design.contracted),
        **_LABEL,
    )
    beyond = 2.0 * scale.unit + 0.1 * width
    _vertical(
        axes,
        start.left - beyond,
        Span(start_low, 0.0),
        f"{-start_low:.4g}",
        -1.0,
    )
    _vertical(
        axes,
        end.right + beyond,
        Span(end_low, 0.0),
        f"{-end_low:.4g}",
    )
    travel = f"travel {end_low - start_low:.4g}"
    _vertical(
        axes,
        0.5 * (start.middle + end.middle),
        Span(start_low, end_low),
        travel,
    )
    across = Span(end.right - scale.diameter, end.right)
    _horizontal(
        axes,
        0.45 * end_low,
        across,
        f"max. dia. {scale.diameter:.3g}",
    )


def _fitting(choice: MuscleChoice) -> float:
    """Length of an end fitting in the drawing [mm]."""
    return FITTING * 1e3 * _nominal_diameter(choice)


def _each_text(name: str, point: EndPoint) -> str:
    return f"{name}: {point.pressure / 1e5:.3g} bar\n{point.force:.4g} N each"


def _draw_state(
    axes: Any, choice: MuscleChoice, point: EndPoint, place: DrawnPlace, scale: Scale
) -> float:
    """All muscles at one end point; return the height of their lower ends [mm]."""
    low = 0.0
    for k in range(choice.count):
        x = place.left + 0.5 * scale.diameter + k * place.pitch
        low = _draw_muscle(axes, choice, point, x, 0.0)
    margin = 0.1 * place.width
    wall = Span(place.left - margin, place.right + margin)
    _draw_wall(axes, wall, _fitting(choice), scale.unit)
    _draw_load(axes, choice, Span(place.left, place.right), low - _fitting(choice))
    return low


def _draw_wall(axes: Any, span: Span, height: float, unit: float) -> None:
    """A fixed wall above the muscles, hatched."""
    axes.plot(
        [span.low, span.high],
        [height, height],
        color="black",
        linewidth=1.4,
    )
    for x in np.linspace(span.low, span.high - unit, 9):
        axes.plot(
            [x, x + unit],
            [height, height + unit],
            color="black",
            linewidth=THIN,
        )


def _draw_load(axes: Any, choice: MuscleChoice, span: Span, top: float) -> None:
    """A crossbar below the muscles and what it carries, in words."""
    axes.plot(
        [span.low, span.high],
        [top, top],
        color="black",
        linewidth=2.4,
    )
    text = _load_text(choice)
    depth = top - 0.10 * choice.length * 1e3
    middle = 0.5 * (span.low + span.high)
    axes.plot(
        [middle, middle],
        [top, depth],
        color=plotting.RED,
        linewidth=1.2,
    )
    axes.plot(
        [middle],
        [depth],
        marker="v",
        markersize=4,
        color=plotting.RED,
    )
    axes.annotate(
        text,
        (middle, depth),
        (0, -5),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=FONT,
    )


def _load_text(choice: MuscleChoice) -> str:
    requirement = choice.requirement
    if isinstance(requirement, GripperRequirement):
        return f"{requirement.fingers:.3g} fingers,\nratio {requirement.lever:.3g}"
    assert isinstance(requirement, LiftRequirement)
    load = f"{requirement.mass:.4g} kg" if requirement.mass else f"{requirement.load(0.0):.4g} N"
    if requirement.lever == 1.0:
        return load
    return f"{load} by a lever,\nratio {requirement.lever:.3g}"


def has_schematic(choice: MuscleChoice) -> bool:
    """Whether a mechanism stands between the muscles and their load."""
    requirement = choice.requirement
    is_lever = isinstance(requirement, LiftRequirement) and requirement.lever != 1.0
    return is_lever or isinstance(requirement, GripperRequirement)


def draw_schematic(axes: Any, choice: MuscleChoice) -> None:
    """Draw the lever or the fingers between the muscles and their load, not to scale."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set(xlim=(-0.45, 1.35), ylim=(-0.62, 0.62))
    requirement = choice.requirement
    if isinstance(requirement, GripperRequirement):
        _draw_fingers(axes, choice, requirement)
    elif isinstance(requirement, LiftRequirement):
        _draw_lever(axes, choice, requirement)


def _pull_text(choice: MuscleChoice, travel: float) -> str:
    force = choice.count * choice.design.contracted.force
    return f"muscles: {force:.4g} N,\n{1e3 * travel:.4g} mm"


def _draw_lever(axes: Any, choice: MuscleChoice, lift: LiftRequirement) -> None:
    """A bar on a pivot, with the arms of muscles and load in their ratio."""
    longest = max(lift.lever, 1.0)
    at_muscle = 1.0 / longest
    at_load = lift.lever / longest
    axes.plot(
        [0.0, 1.0],
        [0.0, 0.0],
        color="black",
        linewidth=2.4,
    )
    axes.plot(
        [0.0],
        [-0.05],
        marker="^",
        markersize=8,
        color=METAL,
    )
    _force(
        axes,
        (at_muscle, 0.04),
        (at_muscle, 0.36),
        plotting.BLUE,
    )
    _force(
        axes,
        (at_load, -0.04),
        (at_load, -0.30),
        plotting.RED,
    )
    force = lift.load(lift.travel) / lift.lever
    load = f"load: {force:.4g} N, {1e3 * lift.stroke:.4g} mm"
    arms = f"arms 1 : {lift.lever:.3g}"
    _write(
        axes,
        at_muscle,
        0.38,
        _pull_text(choice, lift.travel),
        "bottom",
    )
    _write(
        axes,
        at_load - 0.2,
        -0.34,
        load,
        "top",
    )
    _write(
        axes,
        0.0,
        -0.16,
        arms,
        "top",
    )


def _draw_fingers(axes: Any, choice: MuscleChoice, gripper: GripperRequirement) -> None:
    """Two fingers that the muscles close on an object against a spring."""
    from matplotlib.patches import Circle

    axes.add_patch(
        Circle((0.95, 0.0), 0.12, facecolor=MUSCLE, edgecolor="black"),
    )
    _draw_finger(axes, 1.0)
    _draw_finger(axes, -1.0)
    turns = np.linspace(-0.22, 0.22, 9)
    sides = 0.43 + 0.02 * (-1.0) ** np.arange(turns.size)
    axes.plot(
        sides,
        turns,
        color="black",
        linewidth=LINE,
    )
    _force(
        axes,
        (0.28, 0.0),
        (0.02, 0.0),
        plotting.BLUE,
    )
    grip = f"each finger: {gripper.grip:.4g} N, {1e3 * gripper.opening:.4g} mm"
    _write(
        axes,
        -0.2,
        0.05,
        _pull_text(choice, gripper.travel),
        "bottom",
    )
    _write(
        axes,
        0.95,
        -0.46,
        grip,
        "top",
    )


def _draw_finger(axes: Any, side: float) -> None:
    """The finger above, side 1, or below the object, with its force."""
    hinge = 0.3 * side
    axes.plot(
        [0.3, 0.55, 1.1],
        [0.0, hinge, 0.14 * side],
        color="black",
        linewidth=2.4,
    )
    axes.plot(
        [0.55],
        [hinge],
        marker="o",
        markersize=4,
        color=METAL,
    )
    _force(
        axes,
        (0.95, 0.42 * side),
        (0.95, 0.20 * side),
        plotting.RED,
    )


def _write(axes: Any, x: float, y: float, text: str, anchor: str) -> None:
    """A text whose middle is at x."""
    axes.text(
        x,
        y,
        text,
        ha="center",
        va=anchor,
        fontsize=FONT,
    )


def _force(axes: Any, tail: tuple[float, float], head: tuple[float, float], colour: str) -> None:
    """An arrow of a force."""
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.3}
    axes.annotate(
        "",
        head,
        tail,
        arrowprops=style,
    )


def _draw_joint(axes: Any, choice: MuscleChoice, scale: Scale, radius: float) -> None:
    """The pair of a joint below its pulley: one muscle contracted, the other extended."""
    from matplotlib.patches import Circle, Rectangle

    axis = radius + 2.0 * _fitting(choice)
    rim = Circle((0.0, axis), radius, facecolor="white", edgecolor="black", linewidth=1.2)
    axes.add_patch(
        rim,
    )
    axes.add_patch(
        Circle((0.0, axis), 0.08 * radius, facecolor="black"),
    )
    length = 1e3 * choice.length * (1.0 - choice.design.extended.contraction)
    base = -length - _fitting(choice)
    contracted = _draw_side(axes, choice, choice.design.contracted, Side(-radius, base, axis))
    extended = _draw_side(axes, choice, choice.design.extended, Side(radius, base, axis))
    beyond = radius + 0.5 * scale.diameter + 3.0 * scale.unit
    low = base + _fitting(choice)
    _vertical(
        axes,
        -beyond,
        Span(low, contracted),
        f"{contracted - low:.4g}",
        -1.0,
    )
    _vertical(
        axes,
        beyond,
        Span(low, extended),
        f"{extended - low:.4g}",
    )
    wide = radius + scale.diameter
    corner = (-wide, base - scale.unit)
    axes.add_patch(
        Rectangle(corner, 2.0 * wide, scale.unit, facecolor=METAL, edgecolor="black"),
    )
    pulley = Span(-radius, radius)
    _horizontal(
        axes,
        axis + radius + 2.0 * scale.unit,
        pulley,
        f"pulley dia. {2 * radius:.4g}",
    )
    half = 0.5 * scale.diameter
    across = Span(-radius - half, -radius + half)
    middle = 0.5 * (low + contracted)
    _horizontal(
        axes,
        middle,
        across,
        f"max. dia. {scale.diameter:.3g}",
    )
    foot = base - 1.6 * scale.unit
    axes.text(
        -0.1 * radius,
        foot,
        _state_text("contracted", choice.design.contracted),
        **_LEFT,
    )
    axes.text(
        0.1 * radius,
        foot,
        _state_text("extended", choice.design.extended),
        **_RIGHT,
    )
    if choice.count > 1:
        _write(
            axes,
            0.0,
            axis - 0.15 * radius,
            f"{choice.count} pairs",
            "top",
        )


class Side(NamedTuple):
    """Place of one muscle of a pair [mm]: its axis, the height of the base and of the axis of the
    pulley.
    """

    x: float
    base: float
    axis: float


def _draw_side(axes: Any, choice: MuscleChoice, point: EndPoint, side: Side) -> float:
    """One muscle of a pair with its rope to the pulley; return the height of its upper end [mm]."""
    fitting = _fitting(choice)
    top = side.base + fitting + 1e3 * choice.length * (1.0 - point.contraction)
    axes.plot(
        [side.x, side.x],
        [top + fitting, side.axis],
        color="black",
        linewidth=1.0,
    )
    _draw_muscle(axes, choice, point, side.x, top)
    return top


def _state_text(name: str, point: EndPoint) -> str:
    return f"{name}:\n{point.pressure / 1e5:.3g} bar, {point.force:.4g} N"


def _vertical(axes: Any, x: float, span: Span, text: str, side: float = 1.0) -> None:
    """A vertical dimension with its text beside the line."""
    _arrow(axes, (x, span.low), (x, span.high))
    axes.annotate(
        text,
        (x, 0.5 * (span.low + span.high)),
        (2.0 * side, 0.0),
        textcoords="offset points",
        rotation=90,
        fontsize=FONT,
        va="center",
        ha="right" if side < 0.0 else "left",
    )


def _horizontal(axes: Any, y: float, span: Span, text: str) -> None:
    """A horizontal dimension with its text above the line."""
    _arrow(axes, (span.low, y), (span.high, y))
    axes.annotate(
        text,
        (0.5 * (span.low + span.high), y),
        (0.0, 2.0),
        textcoords="offset points",
        fontsize=FONT,
        va="bottom",
        ha="center",
    )


def _arrow(axes: Any, first: tuple[float, float], last: tuple[float, float]) -> None:
    """A line with heads at both ends; the axes include it."""
    axes.plot(
        *zip(first, last, strict=True),
        color="black",
        linewidth=THIN,
    )
    axes.annotate(
        "",
        first,
        last,
        arrowprops=_ARROW,
        annotation_clip=False,
    )


_LABEL = {"ha": "center", "va": "bottom", "fontsize": FONT}
_LEFT = {"ha": "right", "va": "top", "fontsize": FONT}
_RIGHT = {"ha": "left", "va": "top", "fontsize": FONT}
_ARROW = {"arrowstyle": "<->", "linewidth": THIN, "color": "black", "shrinkA": 0, "shrinkB": 0}
