"""Report chapter of a sizing: candidates, requirement, and the figure of the chosen muscle."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core import plotting
from ...core.reference import cite
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobar_plot import isobar_plot
from ...physics.muscle.isobars import compute_isobars
from ...report.chapter import Chapter, Plot, Table
from . import JointRequirement, LiftRequirement, MuscleChoice, SizingConditions, SizingResult
from .scenario import MOVING, scenario_valves

POINTS = 121
"""Points of the curve of the capacity."""


def sizing_plot(choice: MuscleChoice) -> Plot:
    """The chart of one muscle of a choice, as a sizing tool draws it."""
    entry = choice.entry
    valid = validity_range_of(entry.characteristic, entry.validity_range)
    title = f"{choice.total_count} x {entry.name}, {1e3 * choice.length:.4g} mm"
    if choice.design.radius is not None:
        title += f", radius {1e3 * choice.design.radius:.4g} mm"
    plot = isobar_plot(entry.characteristic, title, compute_isobars(entry.characteristic, valid), valid)
    axes = plot.figure.axes[0]
    _draw_limits(axes, choice)
    _draw_load(axes, choice)
    _draw_points(axes, choice)
    plotting.legend_outside(axes)
    caption = (
        f"Force of one {entry.name} over its contraction at constant gauge pressures, with both working points. The "
        "capacity is the force at the maximum working pressure within the permitted force."
    )
    return Plot("working_points", caption, plot.figure)


def _draw_limits(axes: Any, choice: MuscleChoice) -> None:
    muscle = choice.muscle
    contraction = np.linspace(*muscle.contraction_range, POINTS)
    label = f"capacity, {muscle.pressure_range[1] / 1e3:.4g} kPa"
    axes.plot(100 * contraction, muscle.capacity(contraction), color=plotting.BLACK, linewidth=1.8, label=label)
    if muscle.max_force < axes.get_ylim()[1]:
        axes.axhline(muscle.max_force, color=plotting.BLACK, linestyle=":", linewidth=1.0, label="permitted force")
    permitted = muscle.contraction_range[1]
    if 100 * permitted < axes.get_xlim()[1]:
        axes.axvline(100 * permitted, color=plotting.BLACK, linestyle="-.", linewidth=1.0, label="maximum contraction")


def _draw_load(axes: Any, choice: MuscleChoice) -> None:
    """Draw the load of one muscle over the stroke, and with the safety factor; a joint has no single path."""
    if not isinstance(choice.requirement, LiftRequirement):
        return
    displacement, load = choice.requirement.path
    contraction = 100 * (choice.design.extended.contraction + displacement / choice.length)
    factor = choice.conditions.safety_factor
    axes.plot(contraction, load / choice.count, color=plotting.RED, linewidth=2.0, label="load", zorder=3)
    axes.plot(contraction, factor * load / choice.count, color=plotting.RED, linestyle="--", linewidth=1.2,
              label=f"load x {factor:.3g}", zorder=3)  # fmt: skip


def _draw_points(axes: Any, choice: MuscleChoice) -> None:
    lift = isinstance(choice.requirement, LiftRequirement)
    names = ("start", "end") if lift else ("extended", "contracted")
    points = zip((choice.design.extended, choice.design.contracted), names, ("o", "s"), strict=True)
    for point, name, marker in points:
        axes.plot(
            [100 * point.contraction], [point.force], marker=marker, markersize=7, markerfacecolor="white",
            markeredgecolor=plotting.RED, markeredgewidth=1.8, linestyle="none", zorder=4, clip_on=False,
            label=f"{name}: {point.pressure / 1e3:.4g} kPa,\n{100 * point.contraction:.2f} %, {point.force:.4g} N",
        )  # fmt: skip


COMMON = ("muscle", "number", "length")
"""Beginnings of the headers that both tables of the choices have."""


def sizing_chapter(result: SizingResult, note: str = "", simulated: MuscleChoice | None = None) -> Chapter:
    """The chapter of a sizing with at least one choice.

    `note` is a sentence on the scenario, `simulated` the choice of the scenario, if one is written.
    """
    best = result.best
    laws = (best.entry.characteristic, best.conditions.ambient, *scenario_valves(simulated))
    return Chapter(
        paper="sizing",
        title=f"Muscles for {result.requirement.describe()}",
        summary=_summary(best, note),
        tables=(*choice_tables(result), unsuitable_table(result)),
        plots=(sizing_plot(best),),
        references=tuple(best.entry.references) + tuple(cite(laws)),
        chosen=(*_settings(result), *_valve_settings(simulated)),
    )


def choice_row(choice: MuscleChoice) -> dict[str, Any]:
    """A choice by header with unit; None where a value is not known."""
    first, last = choice.design.extended, choice.design.contracted
    row: dict[str, Any] = {
        "muscle": choice.entry.name,
        "number": choice.total_count,
        "length [mm]": 1e3 * choice.length,
        "pressure, long [bar]": first.pressure / 1e5,
        "pressure, short [bar]": last.pressure / 1e5,
        "contraction, long [%]": 100 * first.contraction,
        "contraction, short [%]": 100 * last.contraction,
        "force, long [N]": round(first.force, 9) + 0.0,  # slack to rounding
        "force, short [N]": last.force,
        "reserve [%]": 100 * choice.design.reserve,
        "air a cycle [l (ANR)]": _scaled(choice.reference_volume, 1e3),
        "air a minute [l (ANR)]": _scaled(choice.reference_volume, 6e4 / choice.conditions.cycle_time),
        "energy of the air [J]": choice.air_energy,
        "efficiency [%]": _scaled(choice.efficiency, 100.0),
        "diameter [mm]": _scaled(choice.diameter, 1e3),
    }
    if choice.design.radius is not None and choice.design.radii is not None:
        low, high = choice.design.radii
        row |= {
            "radius [mm]": 1e3 * choice.design.radius,
            "least radius at 1.1 L [mm]": 1e3 * low,
            "maximum radius at 1.1 L [mm]": 1e3 * high,
        }
    return row


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def choice_tables(result: SizingResult) -> tuple[Table, Table]:
    """All choices, best first: end points, then air and dimensions."""
    rows = [choice_row(choice) for choice in result.choices]
    columns = {header: [row[header] for row in rows] for header in rows[0]}
    ends = ("pressure", "contraction", "force", "reserve")
    points = {header: values for header, values in columns.items() if header.startswith((*COMMON, *ends))}
    others = {header: values for header, values in columns.items() if not header.startswith(ends)}
    note = (
        "Long and short: the end points of each muscle. Reserve: force beyond the load at the largest working "
        "pressure. Rows of one product (DMSP-20, say) are different published laws of it: the spread of their lengths "
        "is the uncertainty of the models, not a choice between muscles."
    )
    air = (
        "Air: that of all muscles, at the reference atmosphere of ISO 8778, without tubes; – where the law has no "
        "geometry. Energy: available energy of this air at the supply pressure. Efficiency: work against the load "
        "divided by it. A minute: without pauses. Diameter: at the contracted end, without the wall."
    )
    return Table("choices", "Choices, best first", points, note), Table("air", "Air and dimensions", others, air)


def unsuitable_table(result: SizingResult) -> Table:
    """The muscles that do not meet the requirement, with the reason."""
    columns: dict[str, list[Any]] = {
        "muscle": [item.name for item in result.unsuitable],
        "maximum number tried": [item.count or None for item in result.unsuitable],
        "reason": [item.reason for item in result.unsuitable],
    }
    return Table("unsuitable", "Muscles that do not meet the requirement", columns)


def _summary(best: MuscleChoice, note: str) -> str:
    side = " (half of them on each side)" if isinstance(best.requirement, JointRequirement) else ""
    text = (
        f"The best choice for {best.requirement.describe()} is {best.total_count} x {best.entry.title}{side}, with a "
        f"nominal length of {1e3 * best.length:.4g} mm. This is the shortest length that reaches both end points."
    )
    return f"{text}\n\n{note}" if note else text


def _settings(result: SizingResult) -> tuple[tuple[str, str, str], ...]:
    conditions = result.conditions
    rows = {
        "safety_factor": ("safety factor on the load", f"{conditions.safety_factor:.4g}"),
        "cycle_time": ("cycle time", f"{conditions.cycle_time:.4g} s"),
        "min_pressure": ("minimum working pressure", f"{conditions.min_pressure / 1e5:.4g} bar"),
        "max_count": ("maximum number in parallel", str(conditions.max_count)),
    }
    sources = {name: "chosen" if getattr(conditions, name) == getattr(SizingConditions, name) else "given"
               for name in rows}  # fmt: skip
    stated = (("supply pressure", f"{conditions.supply / 1e5:.4g} bar", "given"),)
    return (*stated, *((*row, sources[name]) for name, row in rows.items()))


def _valve_settings(simulated: MuscleChoice | None) -> tuple[tuple[str, str, str], ...]:
    names = ("fill", "discharge")
    source = f"ISO 6358, for {100 * MOVING:.4g} % of the cycle; this part and the critical pressure ratio are chosen"
    return tuple(
        (f"sonic conductance, {name} valve of each muscle", f"{1e8 * valve.conductance:.4g} dm3/(s bar)", source)
        for name, valve in zip(names, scenario_valves(simulated), strict=False)
    )
