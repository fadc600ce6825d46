"""Tables of a sizing: products, choices and air, valves for a choice; and the chart of a choice."""

import functools
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import AirmuscleWarning, plotting
from ...files.library import list_valves, load
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobars import compute_isobars, isobar_figure
from ...report.chapter import Plot, Table, TableColumn
from . import LawOfProduct, MuscleChoice, PullRequirement
from .scenario import MOVING, air_path

SHORT_VALVES = 4
"""Rows of the brief view (chosen)."""
POINTS = 121
"""Points of the curve of the capacity."""


def product_table(choices: Sequence[MuscleChoice]) -> Table:
    """One row for each product and number of muscles, by the law of the product that is used."""
    cycle = choices[0].conditions.cycle_time
    volumes = [choice.reference_volume for choice in choices]
    designs = [choice.design for choice in choices]
    columns: dict[str, Any] = {
        "product": [choice.product for choice in choices],
        "number": [choice.total_count for choice in choices],
        "nominal length": TableColumn([choice.length for choice in choices], "m", "mm"),
        "mounting area": TableColumn(
            [choice.area for choice in choices], "m2", "cm2", 3, short="area"
        ),
        **_radius(choices, short="radius"),
        "pressure": TableColumn(
            [(c.extended.pressure, c.contracted.pressure) for c in designs], "Pa", "bar", 3
        ),
        "reserve": TableColumn([design.reserve for design in designs], "1", "%", 3),
        "air a minute": TableColumn(
            [v and 60.0 * v / cycle for v in volumes], "m3 (ANR)", "l (ANR)", 3
        ),
        "law": TableColumn([choice.entry.name for choice in choices], brief=False),
    }
    note = (
        "Mounting area: number of muscles x outer diameter at the contracted end x nominal length."
        " Reserve: force beyond the load at the maximum working pressure, as a part of the load."
    )
    return Table("products", "Products, best first", columns, note, brief=len(choices))


def law_table(laws: Sequence[LawOfProduct], best: MuscleChoice) -> tuple[Table, ...]:
    """The published laws of each product with several, side by side: what they rest on, where they
    are valid, and the length that each gives; of the best choice in the brief view.
    """
    rows = _rows_of_laws(laws, best)
    if not rows:
        return ()
    columns: dict[str, Any] = {
        "product": [row.law.product for row in rows],
        "number": [row.number * best.total_count // best.count for row in rows],
        "law": [row.law.name for row in rows],
        "used": ["yes" if row.is_used else "no" for row in rows],
        "rests on": [row.law.strength for row in rows],
        "covers": TableColumn([row.law.coverage for row in rows], "1", "%", 2),
        "nominal length": TableColumn([row.length for row in rows], "m", "mm"),
        "range, or reason": TableColumn([row.remark for row in rows], brief=False),
    }
    note = (
        "The law that is used covers at least half of the working range of the product, its"
        " pressures and contractions, and of these rests on most: the table of the maker, then a"
        " measurement of a specimen of stated length, then of another one, then a shape without"
        " measurements. Lengths by different laws are not averaged."
    )
    brief = sum(row.is_of(best) for row in rows)
    return (Table("laws", "Published laws of each product", columns, note, brief=brief),)


def _rows_of_laws(laws: Sequence[LawOfProduct], best: MuscleChoice) -> "list[LawRow]":
    """The laws of products with several, by number of muscles; those of the best choice first."""
    products = [law.product for law in laws]
    rows = []
    for law in laws:
        if products.count(law.product) > 1:
            is_first = law is laws[products.index(law.product)]
            for number in sorted({*law.choices, *law.reasons} - {0}):
                rows.append(LawRow(law, number, is_first and law.coverage > 0.0))
    return sorted(
        rows, key=lambda row: (not row.is_of(best), products.index(row.law.product), row.number)
    )


class LawRow(NamedTuple):
    """One law of a product with a number of muscles in parallel."""

    law: LawOfProduct
    number: int
    is_used: bool

    def is_of(self, choice: MuscleChoice) -> bool:
        """Whether the row is of the product and the number of a choice."""
        return (self.law.product, self.number) == (choice.product, choice.count)

    @property
    def length(self) -> float | None:
        """Length by the law [m]; None where there is none."""
        choice = self.law.choices.get(self.number)
        return None if choice is None else choice.length

    @property
    def remark(self) -> str:
        """The range of the law, or the reason why it gives no length."""
        return self.law.reasons.get(self.number) or self.law.extent


def _radius(choices: Sequence[MuscleChoice], short: str = "") -> dict[str, TableColumn]:
    if choices[0].design.radius is None:
        return {}
    return {
        "pulley radius": TableColumn(
            [choice.design.radius for choice in choices], "m", "mm", short=short
        )
    }


def end_point_table(choices: Sequence[MuscleChoice]) -> Table:
    """All choices, best first, with the end points of each muscle."""
    first, last = ([getattr(c.design, end) for c in choices] for end in ("extended", "contracted"))
    columns: dict[str, Any] = {**_common(choices)}
    for name, unit, shown in (
        ("pressure", "Pa", "bar"),
        ("contraction", "1", "%"),
        ("force", "N", ""),
    ):
        for end, points in (("long", first), ("short", last)):
            values = [round(getattr(point, name), 9) + 0.0 for point in points]  # slack to rounding
            columns[f"{name}, {end}"] = TableColumn(values, unit, shown)
    columns["reserve"] = TableColumn([choice.design.reserve for choice in choices], "1", "%")
    note = (
        "'Long' and 'short' denote the extended and the contracted end point of each muscle."
        " 'Reserve' is the force beyond the load at the maximum working pressure, as a part of the"
        " load."
    )
    return Table("choices", "Choices, best first", columns, note)


def _common(choices: Sequence[MuscleChoice]) -> dict[str, Any]:
    return {
        "muscle": [choice.entry.name for choice in choices],
        "product": [choice.product for choice in choices],
        "number": [choice.total_count for choice in choices],
        "nominal length": TableColumn([choice.length for choice in choices], "m", "mm"),
    }


def air_table(choices: Sequence[MuscleChoice]) -> Table:
    """Air and dimensions of all choices."""
    cycle = choices[0].conditions.cycle_time
    volumes = [choice.reference_volume for choice in choices]
    columns: dict[str, Any] = {
        **_common(choices),
        "air a cycle": TableColumn(volumes, "m3 (ANR)", "l (ANR)"),
        "air a minute": TableColumn(
            [v and 60.0 * v / cycle for v in volumes], "m3 (ANR)", "l (ANR)"
        ),
        "energy of the air": TableColumn([choice.air_energy for choice in choices], "J"),
        "efficiency": TableColumn([choice.efficiency for choice in choices], "1", "%"),
        "diameter": TableColumn([choice.diameter for choice in choices], "m", "mm"),
        **_radius(choices),
    }
    if choices[0].design.radii is not None:
        ends = [choice.design.radii or (None, None) for choice in choices]
        columns["minimum radius at 1.1 L"] = TableColumn([low for low, _ in ends], "m", "mm")
        columns["maximum radius at 1.1 L"] = TableColumn([high for _, high in ends], "m", "mm")
    note = (
        "Air consumption is the total of all muscles at the reference atmosphere of ISO 8778,"
        " without tubes; a dash indicates that the volume is unknown. Consumption per minute"
        " assumes continuous cycling. Energy: available energy of this air at the supply pressure."
        " Efficiency: work against the load divided by this energy. Diameter: at the contracted"
        " end, without the wall."
    )
    return Table("air", "Air and dimensions", columns, note)


def valve_table(choice: MuscleChoice) -> Table:
    """The valves of the library with the times in which one of them fills and discharges one muscle
    of a choice.
    """
    path = air_path(choice)
    limit = MOVING * choice.conditions.cycle_time
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)  # the table states them
        known: list[Any] = list(map(load, list_valves()))
    times = {
        valve.name: (
            path.time(valve.valve, filling=True),
            path.time(valve.exhaust or valve.valve, filling=False),
        )
        for valve in known
    }
    reaching = {valve.name for valve in known if max(times[valve.name]) <= limit}
    suitable = {valve.name for valve in known if valve.name in reaching and not valve.warning}
    entries = sorted(known, key=lambda valve: (valve.name not in suitable, -times[valve.name][0]))
    columns: dict[str, Any] = {
        "valve": [valve.name for valve in entries],
        "conductance": TableColumn(
            [getattr(valve.valve, "conductance", None) for valve in entries],
            "m3/(s Pa)",
            "dm3/(s bar)",
            3,
        ),
        "fills in": TableColumn([times[valve.name][0] for valve in entries], "s", digits=3),
        "discharges in": TableColumn([times[valve.name][1] for valve in entries], "s", digits=3),
        "reaches the cycle time": TableColumn(
            [valve.name in reaching for valve in entries], brief=False
        ),
        "warning": TableColumn([valve.warning for valve in entries], brief=False),
    }
    note = (
        f"One valve for each muscle, fully open, after its flow law; within {limit:.3g} s it"
        " reaches the cycle time. Switching times and tubes are not contained. The smallest valve"
        " that does so is first; valves that do not, or that have the stated warning, are last."
    )
    title = f"Valves of the library that reach the cycle time with {choice.size}"
    return Table("valves", title, columns, note, brief=min(SHORT_VALVES, len(suitable)))


def sizing_plot(choice: MuscleChoice) -> Plot:
    """The chart of one muscle of a choice, as a sizing tool draws it."""
    caption = (
        f"Force of one {choice.product}{choice.by_law} over its contraction at constant gauge"
        " pressures, with both working points. The capacity is the force at the maximum working"
        " pressure within the permitted force."
    )
    return Plot("working_points", caption, functools.partial(_figure, choice))


def _figure(choice: MuscleChoice) -> Any:
    entry = choice.entry
    valid = validity_range_of(entry.characteristic, entry.validity_range)
    radius = choice.design.radius
    title = choice.size if radius is None else f"{choice.size}, radius {1e3 * radius:.4g} mm"
    figure = isobar_figure(
        entry.characteristic, title, compute_isobars(entry.characteristic, valid), valid
    )
    axes = figure.axes[0]
    muscle = choice.muscle
    contraction = np.linspace(*muscle.contraction_range, POINTS)
    label = f"capacity, {muscle.pressure_range[1] / 1e3:.4g} kPa"
    axes.plot(
        100 * contraction,
        muscle.capacity(contraction),
        color=plotting.BLACK,
        linewidth=1.8,
        label=label,
    )
    if muscle.max_force < axes.get_ylim()[1]:
        axes.axhline(
            muscle.max_force,
            color=plotting.BLACK,
            linestyle=":",
            linewidth=1.0,
            label="permitted force",
        )
    permitted = muscle.contraction_range[1]
    if 100 * permitted < axes.get_xlim()[1]:
        axes.axvline(
            100 * permitted,
            color=plotting.BLACK,
            linestyle="-.",
            linewidth=1.0,
            label="maximum contraction",
        )
    draw_motion(axes, choice)
    plotting.legend_outside(axes)
    return figure


def draw_motion(axes: Any, choice: MuscleChoice) -> None:
    """Both working points, and of a lift the load of one muscle over the stroke, alone and with the
    safety factor.
    """
    names = ("extended", "contracted")
    if isinstance(choice.requirement, PullRequirement):
        names = ("start", "end")
        displacement, load = choice.requirement.path
        contraction = 100 * (choice.design.extended.contraction + displacement / choice.length)
        factor = choice.conditions.safety_factor
        axes.plot(
            contraction,
            load / choice.count,
            color=plotting.RED,
            linewidth=2.0,
            label="load",
            zorder=3,
        )
        axes.plot(
            contraction,
            factor * load / choice.count,
            color=plotting.RED,
            linestyle="--",
            linewidth=1.2,
            label=f"load x {factor:.3g}",
            zorder=3,
        )
    points = zip((choice.design.extended, choice.design.contracted), names, ("o", "s"), strict=True)
    for point, name, marker in points:
        axes.plot(
            [100 * point.contraction],
            [point.force],
            marker=marker,
            markersize=7,
            markerfacecolor="white",
            markeredgecolor=plotting.RED,
            markeredgewidth=1.8,
            linestyle="none",
            zorder=4,
            clip_on=False,
            label=(
                f"{name}: {point.pressure / 1e3:.4g} kPa,\n{100 * point.contraction:.2f} %,"
                f" {point.force:.4g} N"
            ),
        )
