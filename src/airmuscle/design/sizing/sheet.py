"""Sheet of a sizing: the best choice on one page of A4, with drawing, working points, air, valves,
ratings and sources, as a Matplotlib figure.
"""

import textwrap
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import AirmuscleError, Reference, plotting
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobars import compute_isobars
from .arrangement import draw_arrangement, draw_schematic, has_schematic
from .requirement_and_choice import JointRequirement, MuscleChoice
from .result import SizingResult
from .scenario import MOVING, scenario_valves
from .tables import draw_motion, valve_table

INCH = 25.4
PAGE = (210.0, 297.0)
"""Width and height of A4 [mm]."""
MARGIN = 15.0
UNKNOWN = "not known: no source is cited"
TEXT = 7.5
CHARACTERS = 128
VALUE_CHARACTERS = 36
"""Characters of a line across the page, and of a value in the column of quantities."""
LINE_HEIGHT = 4.1
"""Height of a row [mm]."""
MAX_SOURCES = 4


class Box(NamedTuple):
    """Place on the page [mm] from its upper left corner: left, top, width, height."""

    left: float
    top: float
    width: float
    height: float


class SheetRow(NamedTuple):
    """A quantity with its value, as texts."""

    name: str
    value: str


def sizing_sheet(result: SizingResult) -> Any:
    """The best choice of a sizing on one page of A4, as a Matplotlib figure. Raises SolveError
    without a choice.
    """
    import matplotlib as mpl

    choice = result.best
    with mpl.rc_context({"font.size": TEXT}):
        figure = _new_page()
        _write_head(figure, result)
        drawing = _axes(figure, Box(MARGIN, 48.0, 92.0, 104.0))
        if choice.entry.geometry is None:
            drawing.set_axis_off()
            drawing.text(0.5, 0.5, "no geometry is known", ha="center", transform=drawing.transAxes)
        else:
            draw_arrangement(drawing, choice)
        _draw_chart(_axes(figure, Box(27.0, 160.0, 80.0, 58.0)), choice)
        right = Box(115.0, 44.0, 80.0, 200.0)
        top = right.top
        for title, entries in _sections(choice).items():
            top = _write_rows(figure, right._replace(top=top), title, entries)
        if has_schematic(choice):
            draw_schematic(_axes(figure, right._replace(top=top, height=225.0 - top)), choice)
        _write_notes(figure, Box(MARGIN, max(top + 2.0, 229.0), 180.0, 60.0), result)
    return figure


def sheet_page(figure: Any, title: str) -> str:
    """The sheet as a page in HTML that prints on one page of A4."""
    drawing = plotting.rendered(figure, ("svg",))["svg"].decode()
    drawing = drawing[drawing.index("<svg") :]
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>'
        "\n<style>@page { size: A4; margin: 0 } body { margin: 0 }"
        " svg { display: block; width: 210mm; height: 297mm; margin: 0 auto }</style>\n</head>\n"
        f"<body>\n{drawing}</body>\n</html>\n"
    )


def _new_page() -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(PAGE[0] / INCH, PAGE[1] / INCH))
    FigureCanvasAgg(figure)
    return figure


def _axes(figure: Any, box: Box) -> Any:
    bottom = PAGE[1] - box.top - box.height
    return figure.add_axes(
        (box.left / PAGE[0], bottom / PAGE[1], box.width / PAGE[0], box.height / PAGE[1])
    )


def _write(figure: Any, left: float, top: float, text: str, **style: Any) -> None:
    """A text whose upper left corner is at this place [mm]."""
    figure.text(left / PAGE[0], 1.0 - top / PAGE[1], text, va="top", **style)


def _rule(figure: Any, box: Box) -> None:
    from matplotlib.lines import Line2D

    ends = [box.left / PAGE[0], (box.left + box.width) / PAGE[0]]
    height = 1.0 - box.top / PAGE[1]
    figure.add_artist(Line2D(ends, [height, height], color="0.6", linewidth=0.5))


def _write_head(figure: Any, result: SizingResult) -> None:
    choice = result.best
    is_joint = isinstance(choice.requirement, JointRequirement)
    title = f"{choice.size}, half of them on each side" if is_joint else choice.size
    supply = f"supply {choice.conditions.supply / 1e5:.4g} bar"
    sentence = textwrap.fill(result.reason(), CHARACTERS)
    _write(
        figure,
        MARGIN,
        13.0,
        title,
        fontsize=15,
        fontweight="bold",
    )
    _write(
        figure,
        MARGIN,
        22.0,
        f"For {result.requirement.describe()}, {supply}",
        fontsize=10,
    )
    _write(
        figure,
        MARGIN,
        29.0,
        sentence,
        fontsize=TEXT,
        linespacing=1.4,
    )
    _rule(
        figure,
        Box(MARGIN, 41.5, PAGE[0] - 2 * MARGIN, 0.0),
    )
    _write(
        figure,
        MARGIN,
        44.0,
        "Dimensions in mm, to scale",
        fontsize=TEXT,
        color="0.35",
    )


def _write_rows(figure: Any, box: Box, title: str, entries: Sequence[SheetRow]) -> float:
    """A titled block of quantities; return the height [mm] below it."""
    _write(
        figure,
        box.left,
        box.top,
        title,
        fontsize=8.5,
        fontweight="bold",
    )
    top = box.top + 4.8
    for entry in entries:
        lines = textwrap.wrap(entry.value, VALUE_CHARACTERS) or [""]
        _write(
            figure,
            box.left,
            top,
            entry.name,
            fontsize=TEXT,
            color="0.35",
        )
        for line in lines:
            right = (box.left + box.width) / PAGE[0]
            figure.text(right, 1.0 - top / PAGE[1], line, va="top", ha="right", fontsize=TEXT)
            top += LINE_HEIGHT - 0.3
        top += 0.3
    _rule(
        figure,
        box._replace(top=top + 0.4),
    )
    return top + 2.2


def _sections(choice: MuscleChoice) -> dict[str, list[SheetRow]]:
    """The rows of the column of quantities, by their titles."""
    return {
        "Choice": list(_choice_entries(choice)),
        "Working points of one muscle": list(_point_entries(choice)),
        "Cycle and air of all muscles": list(_air_entries(choice)),
        "Valves and regulator, for each muscle": list(_valve_entries(choice)),
        "Permitted by the maker": list(_rating_entries(choice)),
    }


def _choice_entries(choice: MuscleChoice) -> Iterator[SheetRow]:
    yield SheetRow("product", choice.product)
    yield SheetRow("number", str(choice.total_count))
    yield SheetRow("nominal length", f"{1e3 * choice.length:.4g} mm")
    if choice.design.radius is not None:
        yield SheetRow("pulley radius", f"{1e3 * choice.design.radius:.4g} mm")
    at_rest = choice.muscle.diameter(0.0)
    if at_rest is not None and choice.diameter is not None:
        ends = f"{1e3 * at_rest:.3g} mm, {1e3 * choice.diameter:.3g} mm"
        yield SheetRow("outer diameter at rest, contracted", ends)
    if choice.area is not None:
        yield SheetRow("mounting area", f"{1e4 * choice.area:.3g} cm2")
    yield SheetRow("order code, price", UNKNOWN)
    yield SheetRow("life", UNKNOWN)


def _point_entries(choice: MuscleChoice) -> Iterator[SheetRow]:
    first = choice.design.extended
    last = choice.design.contracted
    reserve = 100 * choice.design.reserve
    factor = choice.conditions.safety_factor
    yield SheetRow("pressure", _range(first.pressure / 1e5, last.pressure / 1e5, "bar"))
    yield SheetRow("contraction", _range(100 * first.contraction, 100 * last.contraction, "%"))
    yield SheetRow("force", _range(first.force, last.force, "N"))
    yield SheetRow("force reserve at least", f"{reserve:.3g} %")
    yield SheetRow("safety factor that was asked", f"{factor:.3g}")


def _range(first: float, last: float, unit: str) -> str:
    """Both ends of a range as text, or one number where they are shown alike."""
    low = f"{first + 0.0:.4g}"
    high = f"{last + 0.0:.4g}"
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _air_entries(choice: MuscleChoice) -> Iterator[SheetRow]:
    cycle = choice.conditions.cycle_time
    yield SheetRow("cycle, there and back", f"{cycle:.3g} s, {MOVING * cycle:.3g} s each way")
    volume = choice.reference_volume
    if volume is None or choice.efficiency is None or choice.air_energy is None:
        yield SheetRow("air", "not known: the law has no geometry")
        return
    yield SheetRow("air a cycle", f"{1e3 * volume:.3g} l (ANR)")
    yield SheetRow("air a minute", f"{6e4 * volume / cycle:.3g} l (ANR)")
    yield SheetRow(
        "energy of the air, efficiency",
        f"{choice.air_energy:.3g} J, {100 * choice.efficiency:.2g} %",
    )
    yield SheetRow("volume from", choice.geometry_source)


def _valve_entries(choice: MuscleChoice) -> Iterator[SheetRow]:
    try:
        fill, discharge = scenario_valves(choice)
    except AirmuscleError:
        yield SheetRow("valves", "not known: the volume or the flow is")
        return
    conductances = f"{1e8 * fill.conductance:.3g}, {1e8 * discharge.conductance:.3g} dm3/(s bar)"
    yield SheetRow("conductance C, in and out", conductances)
    table = valve_table(choice)
    reaching = [
        name
        for name, suffices, warning in zip(
            *(table.columns[key].values for key in ("valve", "reaches the cycle time", "warning")),
            strict=True,
        )
        if suffices and not warning
    ]
    yield SheetRow(
        "smallest valve of the library", reaching[0] if reaching else "none reaches the cycle time"
    )
    last = choice.design.contracted.pressure / 1e5
    first = choice.design.extended.pressure / 1e5
    yield SheetRow("regulator", f"{first:.3g} to {last:.3g} bar, with this flow")


def _rating_entries(choice: MuscleChoice) -> Iterator[SheetRow]:
    ratings = choice.entry.ratings
    ranges = {} if ratings is None else {row.quantity: str(row) for row in ratings.ranges()}
    names = {
        "force": "force",
        "pressure": "pressure (gauge)",
        "contraction": "contraction",
        "length": "nominal length",
        "temperature": "temperature",
    }
    for quantity, name in names.items():
        yield SheetRow(name, ranges.get(quantity, UNKNOWN))


def _draw_chart(axes: Any, choice: MuscleChoice) -> None:
    """Isobars, capacity, load and both working points."""
    entry = choice.entry
    valid = validity_range_of(entry.characteristic, entry.validity_range)
    curves = compute_isobars(entry.characteristic, valid)
    muscle = choice.muscle
    for forces in curves.forces:
        axes.plot(
            100 * curves.contractions,
            forces,
            color="0.75",
            linewidth=0.7,
        )
    contraction = np.linspace(*muscle.contraction_range, 121)
    capacity = muscle.capacity(contraction)
    label = f"capacity, {muscle.pressure_range[1] / 1e5:.3g} bar"
    axes.plot(
        100 * contraction,
        capacity,
        color="black",
        linewidth=1.6,
        label=label,
    )
    draw_motion(axes, choice)
    need = choice.conditions.safety_factor * max(
        point.force for point in (choice.design.extended, choice.design.contracted)
    )
    axes.set_ylim(
        0.0,
        min(1.05 * float(capacity.max()), 4.0 * need),
    )
    axes.set_xlim(
        100 * muscle.contraction_range[0],
        100 * muscle.contraction_range[1],
    )
    axes.set_xlabel(
        "contraction [%]",
        fontsize=TEXT,
    )
    axes.set_ylabel(
        "force of one muscle [N]",
        fontsize=TEXT,
    )
    axes.tick_params(labelsize=TEXT - 0.5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(
        fontsize=6.5,
        frameon=False,
        loc="upper right",
    )


def _write_notes(figure: Any, box: Box, result: SizingResult) -> None:
    """The law with what the others give, what is chosen, and the sources."""
    choice = result.best
    conditions = choice.conditions
    law = result.reasons_for_the_law() or f"The law used is {choice.entry.name}."
    chosen = (
        f"Chosen: least working pressure {conditions.min_pressure / 1e5:.3g} bar, parts of the"
        f" cycle, critical pressure ratio of the valves 0.3; friction and tubes are left out."
        " A length other than that of the measured specimen is a scaling of the law."
    )
    sources = dict.fromkeys(map(_source, choice.entry.references))
    texts = [law, chosen, "Sources: " + "; ".join(list(sources)[:MAX_SOURCES]) + "."]
    if not sources:
        texts.pop()
    top = box.top
    _rule(
        figure,
        box,
    )
    for text in texts:
        lines = textwrap.wrap(text, CHARACTERS)
        _write(
            figure,
            box.left,
            top + 2.0,
            "\n".join(lines),
            fontsize=7.0,
            linespacing=1.35,
        )
        top += 3.5 * len(lines) + 1.5
    _write(
        figure,
        MARGIN,
        287.0,
        f"airmuscle size: {choice.size}",
        fontsize=6.5,
        color="0.35",
    )


def _source(reference: Reference) -> str:
    parts = (reference.authors, reference.title, reference.where, reference.year)
    return ", ".join(str(part) for part in parts if part)
