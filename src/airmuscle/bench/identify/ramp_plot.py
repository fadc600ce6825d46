"""Plot of isometric ramps: force over pressure, one curve for each held contraction, one panel for each length."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core import plotting
from ...core.arrays import Array
from ...core.display import level_text
from ...recording import Recording
from ...report.chapter import Plot
from . import Fit
from .force_evaluation import evaluate_force
from .levels import LEVEL_TOLERANCE, MAX_LEVEL_WIDTH, held_levels, is_pressure_ramp, levels_of

MAX_PANELS, MAX_CURVES = 4, 6
"""Maximum numbers of resting lengths, and of contractions for each of them; evenly selected if there are more."""
POINTS = 121


def ramp_plot(fit: Fit) -> Plot | None:
    """Return measured and modelled force over pressure at the held contractions; None if the pressure was not swept
    at held contractions."""
    data = fit.recording
    if not is_pressure_ramp(data["pressure"], data["contraction"]):
        return None
    lengths = data.columns.get("resting_length")
    panels: list[float | None] = [None] if lengths is None else [float(x) for x in levels_of(lengths, MAX_PANELS)]
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    width, height = (6.3, 3.6) if len(panels) == 1 else (7.4, 2.9 * rows + 0.4)
    figure, axes = plotting.new_figure(rows, columns, width=width, height=height, squeeze=False, sharey=True)
    for axis, length in zip(axes.ravel(), panels, strict=False):
        selected = np.full(len(data), True) if lengths is None or length is None else _at(lengths, length)
        _draw_panel(axis, fit, data.rows(selected), length)
    for axis in axes.ravel()[len(panels) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("force [N]")
    caption = "Force over gauge pressure at the held contractions; points: measured, lines: model."
    return Plot("ramps", caption, figure)


def _at(values: Array, level: float) -> Any:
    return np.abs(values - level) <= MAX_LEVEL_WIDTH * LEVEL_TOLERANCE * np.abs(values).max()


def _draw_panel(axes: Any, fit: Fit, data: Recording, length: float | None) -> None:
    """Draw the ramps of one resting length [m]."""
    law: Any = fit.model
    if length is not None and hasattr(law, "with_resting_length"):
        law = law.with_resting_length(length)
    levels = held_levels(data["contraction"]).values
    selected = levels[np.unique(np.linspace(0, levels.size - 1, min(levels.size, MAX_CURVES)).astype(int))]
    for i, level in enumerate(selected):
        rows = data.rows(_at(data["contraction"], level) if levels.size > 1 else slice(None))
        pressure = np.linspace(rows["pressure"].min(), rows["pressure"].max(), POINTS)
        force = evaluate_force(law, pressure, np.full(POINTS, level), float(fit.recording["force"].max()))
        colour, marker = plotting.LINES[i % len(plotting.LINES)], plotting.MARKERS[i % len(plotting.MARKERS)]
        points = {"linestyle": "none", "marker": marker, "markersize": 2.2, "alpha": 0.45, "markeredgewidth": 0.5}
        axes.plot(rows["pressure"] / 1e3, rows["force"], color=colour, **points)
        label = level_text("contraction", float(level), float(np.abs(levels).max()))
        style = {"linestyle": plotting.DASHES[i % len(plotting.DASHES)], "linewidth": 1.6}
        axes.plot(pressure / 1e3, force, color=colour, label=label, **style)
    axes.set(xlabel="gauge pressure [kPa]")
    if length is not None:
        axes.set_title(f"resting length {1e3 * length:.4g} mm", fontsize=9)
    axes.legend(title="contraction", loc="upper left", fontsize=8, title_fontsize=8, frameon=False)
