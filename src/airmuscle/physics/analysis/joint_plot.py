"""Figure of the statics of a joint: reachable angles and stiffnesses, and the pressures that give them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.plotting import BLUE, RED, new_figure
from .statics_of_joint import JointStatics

ANGLES = 121
"""Number of angles of the reachable region (chosen)."""
PRESSURES = 25
"""Number of pressures of each muscle for the contour lines (chosen)."""


def plot_reachable_region(statics: JointStatics, load: float = 0.0) -> Any:
    """Return a Matplotlib figure of the reachable region of a joint under a load [N m].

    Left: the stiffnesses at constant pressure that are reachable at each angle with two taut muscles. Right: the plane
    of the pressures of both muscles with lines of equal stiffness and of equal angle; where there are several
    equilibria, the lowest stable angle is drawn.
    """
    figure, (region, plane) = new_figure(1, 2, width=7.2, height=3.4)
    _draw_region(region, statics, load)
    _draw_plane(plane, statics, load)
    return figure


def _draw_region(axes: Any, statics: JointStatics, load: float) -> None:
    angle = np.linspace(*statics.angle_range, ANGLES)
    low, high = statics.stiffness_limits(angle, load)
    axes.fill_between(np.degrees(angle), low, high, color=BLUE, alpha=0.2, linewidth=0.0)
    for limit in (low, high):
        axes.plot(np.degrees(angle), limit, color=BLUE)
    axes.set_xlabel("angle [deg]")
    axes.set_ylabel("stiffness at constant pressure [N m/rad]")
    axes.set_title(f"Reachable region, load {load:.4g} N m")


def _draw_plane(axes: Any, statics: JointStatics, load: float) -> None:
    levels = np.linspace(*statics.pressure_range, PRESSURES)
    first, second = (p.reshape(-1) for p in np.meshgrid(levels, levels))
    points = statics.angles((first, second), load)
    usable = (points.stable == 1.0) & (points.tensions > 0.0).all(axis=2)
    column = np.argmax(usable, axis=1)
    rows = np.arange(first.size)

    def table(values: Array) -> Array:
        chosen = np.where(usable.any(axis=1), values[rows, column], np.nan)
        return np.asarray(chosen.reshape(PRESSURES, PRESSURES))

    first_name, second_name = (muscle.name for muscle in statics.plant.muscles)
    grid = levels / 1e5
    for values, colour, style, text in (
        (points.constant_pressure, BLUE, "solid", "%.3g"),
        (np.degrees(points.angle), RED, "dashed", "%.3g°"),
    ):
        lines = axes.contour(grid, grid, table(values), levels=7, colors=[colour], linestyles=style, linewidths=1.0)
        axes.clabel(lines, fmt=text, fontsize=7)
    axes.set_xlabel(f"pressure of {first_name} [bar]")
    axes.set_ylabel(f"pressure of {second_name} [bar]")
    axes.set_title("Solid: stiffness [N m/rad], dashed: angle")
