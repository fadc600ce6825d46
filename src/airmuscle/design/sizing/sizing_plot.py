"""Force-contraction chart of a choice: isobars, capacity of the muscle, load, and working points at both ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core import plotting
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobar_plot import isobar_plot
from ...physics.muscle.isobars import compute_isobars
from ...report.chapter import Plot
from . import LiftRequirement, MuscleChoice

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
