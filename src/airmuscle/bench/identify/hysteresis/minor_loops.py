"""Force of a friction law around an outer loop with two inner loops, as a path and as a figure."""

import itertools
from typing import Any

import numpy as np

from ....core import DASHES, LINES, Array, legend_below, new_figure
from ....physics.muscle.friction import Friction
from .loop_data import MILLIMETRES, Axis

TURNING_POINTS, ROWS_PER_LEG = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0), 200
"""Turning points of the path of `plot_loops`, as multiples of the presliding distance of the law, and rows between two
of them (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Legs of the path that form the inner loops, first and last plus one."""


def loop_path(distance: float) -> Array:
    """A path [m] from rest around an outer loop with two inner loops, scaled by a distance [m]."""
    turning_points = itertools.pairwise((0.0, *TURNING_POINTS))
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in turning_points]
    return distance * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Friction force over displacement: from rest, around the outer loop, through two inner loops. Returns a Matplotlib
    figure."""
    path = loop_path(friction.presliding_distance or 1e-3)
    force = friction.force_along(path)
    outer, parts = force.copy(), [(force, 0, 1, "from rest", 1)]
    for (a, b), name in zip(INNER_LOOPS, ("inner loops", ""), strict=True):
        outer[a * ROWS_PER_LEG + 1 : b * ROWS_PER_LEG] = np.nan
        parts.append((force, a, b, name, 2))
    figure, axes = new_figure(width=5.6, height=3.9)
    for values, a, b, name, style in [(outer, 1, len(TURNING_POINTS), "outer loop", 0), *parts]:
        rows, label = slice(a * ROWS_PER_LEG, b * ROWS_PER_LEG + 1), name or None
        axes.plot(path[rows] * axis.factor, values[rows], color=LINES[style], linestyle=DASHES[style], label=label)
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure
