"""Figures of hysteresis: a friction law with its inner loops, and a fit with its residuals."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ....core.arrays import Array
from ....core.plotting import DASHES, LINES, given_axes, legend_below, new_figure, relabel_in_display_units
from ....physics.muscle.friction import Friction
from .limits import MILLIMETRES, Axis
from .series import LoopSeries

TURNING_POINTS = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0)
"""Turning points of the path of `plot_loops`, as multiples of the presliding distance of the law (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Legs of the path that form the inner loops, first and last plus one."""
ROWS_PER_LEG = 200
"""Rows between two turning points."""


def loop_path(distance: float) -> Array:
    """A path [m] from rest around an outer loop with two inner loops, scaled by a distance [m]."""
    turning_points = itertools.pairwise((0.0, *TURNING_POINTS))
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in turning_points]
    return distance * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Friction force over displacement: from rest, around the outer loop, through two inner loops.

    Returns a Matplotlib figure.
    """
    path = loop_path(friction.presliding_distance or 1e-3)
    force = friction.force_along(path)
    parts = [("outer loop", ROWS_PER_LEG, len(path)), ("from rest", 0, ROWS_PER_LEG + 1)]
    parts += [
        ("inner loops" if i == 0 else "", a * ROWS_PER_LEG, b * ROWS_PER_LEG + 1)
        for i, (a, b) in enumerate(INNER_LOOPS)
    ]
    outer = force.copy()
    for a, b in INNER_LOOPS:
        outer[a * ROWS_PER_LEG + 1 : b * ROWS_PER_LEG] = np.nan
    figure, axes = new_figure(width=5.6, height=3.9)
    for (name, first, last), style in zip(parts, (0, 1, 2, 2), strict=True):
        rows, label = slice(first, last), name or None
        values = force if style else outer
        axes.plot(path[rows] * axis.factor, values[rows], color=LINES[style], linestyle=DASHES[style], label=label)
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure


def plot_hysteresis(series: LoopSeries, friction: Friction, coefficients: Array, title: str, *, ax: Any = None) -> Any:
    """Measured force minus static curve over the path, with the friction force; and the residuals below.

    `coefficients` are those of the static curve. `ax` is an Axes, or a sequence of two, also for the residuals.
    Returns `ax`, or a new Matplotlib figure if it is None. Raises ParameterError for another `ax`.
    """
    measured = series.target - series.design_matrix @ coefficients
    if ax is None:
        figure, axes = new_figure(2, 1, width=6.0, height=5.6, sharex=True)
    else:
        figure, axes = None, given_axes(ax, 1, "plot of a loop")
    upper, lower = axes[0], axes[1] if len(axes) > 1 else None
    path, rows = series.path * series.axis.factor, series.fitted_rows
    force = -series.friction_force(friction)
    points: dict[str, Any] = {"marker": "o", "markersize": 3, "linestyle": "none", "color": LINES[0], "alpha": 0.5}
    upper.plot(path[rows], measured[rows], **points, label="measured - static curve")
    upper.plot(path, force, color=LINES[1], label=f"{type(friction).__name__}, whole path")
    upper.set_ylabel("force [N]")
    if lower is not None:
        lower.plot(path[rows], (force - measured)[rows], **points)
        lower.axhline(0.0, color=LINES[1])
        lower.set_ylabel("residual (model - measured) [N]")
    (upper if lower is None else lower).set_xlabel(series.axis.label)
    relabel_in_display_units([upper] if lower is None else [upper, lower])
    if figure is None:
        upper.legend(loc="best", frameon=False, fontsize=8)
        return ax
    upper.set_title(title)
    legend_below(figure, upper, 2)
    return figure
