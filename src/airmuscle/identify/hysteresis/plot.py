"""Figures of loops: a friction law with its inner loops, and a fit beside its data."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.arrays import Array
from ...core.plotting import DASHES, LINES, legend_below, new_figure
from ...friction import Friction
from .result import MILLIMETRES, Axis

if TYPE_CHECKING:
    from .result import HysteresisFit

TURNING_POINTS = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0)
"""Turning points of the path of `plot_loops`, as multiples of the law's travel (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Which of the ways between them are inner loops."""
ROWS_PER_LEG = 200
"""Rows of each way."""


def loop_path(travel: float) -> Array:
    """A path [m] from rest around an outer loop, with two inner loops on its way up."""
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in itertools.pairwise((0.0, *TURNING_POINTS))]
    return travel * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Force over displacement of a friction law: from rest, around the outer loop, through two inner ones."""
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
        shown = force if style else outer
        axes.plot(path[rows] * axis.factor, shown[rows], color=LINES[style], linestyle=DASHES[style], label=label)
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure


def plot_hysteresis(fit: HysteresisFit) -> Any:
    """What the static curve leaves of the force over the path, with the fitted friction; and the errors."""
    run = fit.series
    left = run.target - run.design_matrix @ fit.coefficients
    figure, (upper, lower) = new_figure(2, 1, width=6.0, height=5.6, sharex=True)
    path = run.path * run.axis.factor
    force = -fit.friction.force_along(run.path, run.time)
    upper.plot(
        path[run.fitted_rows],
        left[run.fitted_rows],
        "o",
        color=LINES[0],
        alpha=0.5,
        label="measured, less static curve",
    )
    upper.plot(path, force, color=LINES[1], label=f"{type(fit.friction).__name__}, along the whole path")
    upper.set_ylabel("force [N]")
    lower.plot(path[run.fitted_rows], (left - force)[run.fitted_rows], "o", color=LINES[0], alpha=0.5)
    lower.axhline(0.0, color=LINES[1])
    lower.set(xlabel=run.axis.label, ylabel="measured less modelled [N]")
    upper.set_title(f"{run.origin}: rms {fit.rmse_without_friction:.3g} N without, {fit.rmse:.3g} N with friction")
    legend_below(figure, upper, 2)
    return figure
