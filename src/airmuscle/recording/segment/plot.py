"""The figure of an inspection: what was measured over time, and what was seen in it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.plotting import BLUE, GREEN, ORANGE, PURPLE, RED, legend_below, new_figure
from ..plot import display_scale
from .inspection import Inspection
from .sensor import Sensor

_SHOWN = ("pressure", "force", "contraction", "length", "position", "temperature")


def plot_inspection(seen: Inspection) -> Any:
    """An axis for each column: readings as points, coloured by branch; plateaus as bars, glitches as crosses."""
    recording = seen.recording
    names = [n for n in _SHOWN if n in recording] or [n for n in recording if n != "time"]
    if "contraction" in names and "length" in names:
        names.remove("length")
    across = recording["time"] if "time" in recording else np.arange(1, len(recording) + 1)
    figure, axes = new_figure(len(names), 1, height=1.1 + 1.5 * len(names), sharex=True, squeeze=False)
    for axis, name in zip(axes[:, 0], names, strict=True):
        _draw(axis, seen, name, across)
        _, unit = display_scale(name)
        axis.set_ylabel(f"{name}\n[{unit}]")
    axes[-1, 0].set_xlabel("time [s]" if "time" in recording else "row")
    figure.align_ylabels()
    figure.suptitle(recording.origin, fontsize=9)
    legend_below(figure, axes[0, 0], columns=4)
    return figure


def _draw(axis: Any, seen: Inspection, name: str, across: Any) -> None:
    factor, _ = display_scale(name)
    values = seen.recording[name] * factor
    dots = {"linestyle": "none", "marker": ".", "markersize": 2.5}
    colours = {1: (BLUE, "inflating"), -1: (RED, "deflating")}
    if not seen.branches:
        axis.plot(across, values, color=BLUE, label="measured", **dots)
    for branch in seen.branches:
        rows = branch.interval.rows
        colour, label = colours[branch.direction]
        known = axis.get_legend_handles_labels()[1]
        axis.plot(across[rows], values[rows], color=colour, label=None if label in known else label, **dots)
    for i, plateau in enumerate(seen.plateaus):
        ends = across[[plateau.interval.start, plateau.interval.stop - 1]]
        level = [plateau.values.get(name, np.nan) * factor] * 2
        axis.plot(ends, level, color=GREEN, linewidth=1.2, label="plateau" if i == 0 else None)
    _mark_glitches(axis, seen, name, across, values)
    if name in seen.sensors:
        _mark_ends(axis, seen.sensors[name], values, factor)


def _mark_glitches(axis: Any, seen: Inspection, name: str, across: Any, values: Any) -> None:
    """All glitches are in the first axis' legend, even where another column has them."""
    rows = [outlier.row for outlier in seen.outliers if outlier.column == name]
    if seen.outliers:
        style = {"linestyle": "none", "marker": "x", "markersize": 6, "color": PURPLE}
        axis.plot(across[rows], values[rows], label="suspected glitch", **style)


def _mark_ends(axis: Any, sensor: Sensor, values: Any, factor: float) -> None:
    for end in (sensor.lower_limit, sensor.upper_limit):
        if np.isfinite(end) and values.size:
            axis.axhline(end * factor, color=ORANGE, linestyle="--", linewidth=1.0)
            axis.annotate("cut off", (0.995, end * factor), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                          fontsize=7, color=ORANGE)  # fmt: skip
