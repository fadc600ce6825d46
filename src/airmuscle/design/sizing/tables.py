"""Tables of a sizing: products, choices and air, valves for a choice; and the chart of a choice."""

import functools
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import AirmuscleWarning, plotting
from ...files.library import list_valves, load, products_of_laws
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobars import compute_isobars, isobar_figure
from ...report.chapter import Plot, Table, TableColumn
from . import LiftRequirement, MuscleChoice
from .scenario import MOVING, air_path

SHORT_VALVES = 4
"""Rows of the brief view (chosen)."""
POINTS = 121
"""Points of the curve of the capacity."""


def product_of(choice: MuscleChoice) -> str:
    """The product on which the law of a choice was measured, or the name of its entry."""
    return products_of_laws().get(choice.entry.name) or choice.entry.name


def product_table(choices: Sequence[MuscleChoice]) -> Table:
    """One row for each product and number of muscles: its best law, and the lengths by all its
    laws.
    """
    groups: dict[tuple[str, int], list[MuscleChoice]] = {}
    for choice in choices:
        groups.setdefault((product_of(choice), choice.total_count), []).append(choice)
    first = [group[0] for group in groups.values()]
    cycle = choices[0].conditions.cycle_time
    volumes = [choice.reference_volume for choice in first]
    lengths = [sorted(choice.length for choice in group) for group in groups.values()]
    designs = [choice.design for choice in first]
    several = any(len(each) > 1 for each in lengths)
    columns: dict[str, Any] = {
        "product": [product for product, _ in groups],
        "number": [number for _, number in groups],
        "nominal length": TableColumn([choice.length for choice in first], "m", "mm"),
        "length by all laws": TableColumn(
            [(each[0], each[-1]) for each in lengths], "m", "mm", brief=several
        ),
        **_radius(first, short="radius"),
        "pressure": TableColumn(
            [(c.extended.pressure, c.contracted.pressure) for c in designs], "Pa", "bar", 3
        ),
        "reserve": TableColumn([each.reserve for each in designs], "1", "%", 3),
        "air a minute": TableColumn(
            [v and 60.0 * v / cycle for v in volumes], "m3 (ANR)", "l (ANR)", 3
        ),
        "law": TableColumn([choice.entry.name for choice in first], brief=False),
    }
    note = (
        "Each product by the law of its best choice; length by all laws: the range by its published"
        " laws."
    )
    return Table("products", "Products, best first", columns, note, brief=len(first))


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
            values = [round(getattr(each, name), 9) + 0.0 for each in points]  # slack to rounding
            columns[f"{name}, {end}"] = TableColumn(values, unit, shown)
    columns["reserve"] = TableColumn([choice.design.reserve for choice in choices], "1", "%")
    note = (
        "Long and short: the end points of each muscle. Reserve: force beyond the load at the"
        " largest working pressure. Rows of one product are different published laws of it."
    )
    return Table("choices", "Choices, best first", columns, note)


def _common(choices: Sequence[MuscleChoice]) -> dict[str, Any]:
    return {
        "muscle": [choice.entry.name for choice in choices],
        "product": [product_of(choice) for choice in choices],
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
        "Air: that of all muscles, at the reference atmosphere of ISO 8778, without tubes; – where"
        " the law has no geometry. Energy: available energy of this air at the supply pressure."
        " Efficiency: work against the load divided by it. A minute: without pauses. Diameter: at"
        " the contracted end, without the wall."
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
        each.name: (
            path.time(each.valve, filling=True),
            path.time(each.exhaust or each.valve, filling=False),
        )
        for each in known
    }
    reaching = {each.name for each in known if max(times[each.name]) <= limit}
    suitable = {each.name for each in known if each.name in reaching and not each.warning}
    entries = sorted(known, key=lambda each: (each.name not in suitable, -times[each.name][0]))
    columns: dict[str, Any] = {
        "valve": [each.name for each in entries],
        "conductance": TableColumn(
            [getattr(each.valve, "conductance", None) for each in entries],
            "m3/(s Pa)",
            "dm3/(s bar)",
            3,
        ),
        "fills in": TableColumn([times[each.name][0] for each in entries], "s", digits=3),
        "discharges in": TableColumn([times[each.name][1] for each in entries], "s", digits=3),
        "reaches the cycle time": TableColumn(
            [each.name in reaching for each in entries], brief=False
        ),
        "warning": TableColumn([each.warning for each in entries], brief=False),
    }
    note = (
        f"One valve for each muscle, fully open, after its flow law; within {limit:.3g} s it"
        " reaches the cycle time. Switching times and tubes are not contained. The smallest valve"
        " that does so is first; valves that do not, or that have the stated warning, are last."
    )
    title = (
        f"Valves of the library that reach the cycle time with {choice.entry.name},"
        f" {1e3 * choice.length:.4g} mm"
    )
    return Table("valves", title, columns, note, brief=min(SHORT_VALVES, len(suitable)))


def sizing_plot(choice: MuscleChoice) -> Plot:
    """The chart of one muscle of a choice, as a sizing tool draws it."""
    caption = (
        f"Force of one {choice.entry.name} over its contraction at constant gauge pressures, with"
        " both working points. The capacity is the force at the maximum working pressure within"
        " the permitted force."
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
    _draw_motion(axes, choice)
    plotting.legend_outside(axes)
    return figure


def _draw_motion(axes: Any, choice: MuscleChoice) -> None:
    """Both working points, and of a lift the load of one muscle over the stroke, alone and with the
    safety factor.
    """
    names = ("extended", "contracted")
    if isinstance(choice.requirement, LiftRequirement):
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
