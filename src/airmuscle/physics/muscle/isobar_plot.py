"""Isobar plot of a characteristic: force over contraction at constant pressures, with an optional working point."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from ...core import plotting
from ...core.display import contraction_text, quantity_text
from ...recording import Recording
from ...report.chapter import Plot, Table
from .characteristic.base import Characteristic
from .characteristic.validity_range import ValidityRange
from .isobars import Isobars, WorkingPoint, force_axis_limit, forces_along, mask_slack

DASHES = plotting.DASHES[:5]
"""Line styles that are distinguishable on neighbouring curves."""
PRESSURE_TOLERANCE = 0.005
"""Maximum difference between a measured point and its isobar, as a fraction of the maximum pressure (chosen)."""
MAX_TITLE_LINES = 3
"""Maximum number of lines of a title; the rest is left out."""
MANY_POINTS = 500
"""Number of measured rows above which they are a cloud under the lines of the model (chosen)."""


def isobar_table(curves: Isobars, name: str = "isobars") -> Table:
    """Return the isobars as a table with one column of tensions per pressure."""
    columns = {
        f"force at {pressure / 1e3:.6g} kPa [N]": forces
        for pressure, forces in zip(curves.pressures, curves.forces, strict=True)
    }
    return Table(name, "Isobars", {"contraction [1]": curves.contractions, **columns}, "Gauge pressures.", shown=False)


def isobar_plot(
    characteristic: Characteristic,
    title: str,
    curves: Isobars,
    validity_range: ValidityRange | None = None,
    point: WorkingPoint | None = None,
    measured: Recording | None = None,
) -> Plot:
    """Return the figure of the isobars: shaded outside the validity range, with the working point if one is given.

    `measured` points are drawn with the curve of the same pressure.
    """
    figure, axes = plotting.new_figure()
    _draw_isobars(axes, curves, point, measured)
    if validity_range is not None:
        _shade_extrapolation(axes, validity_range, curves)
    if point is not None:
        _draw_working_point(axes, characteristic, curves, point)
    axes.set(
        xlabel="contraction [%]",
        ylabel="force [N]",
        xlim=(100 * curves.contractions[0], 100 * curves.contractions[-1]),
        ylim=(0.0, 1.06 * _force_axis_limit(curves, point, measured)),
    )
    axes.set_title(textwrap.fill(title, 60, max_lines=MAX_TITLE_LINES, placeholder=" …"), fontsize=9)
    plotting.legend_outside(axes, title="gauge pressure")
    caption = f"{title}: force over contraction at constant gauge pressure."
    if point is not None:
        caption += f" Working point: {describe_point(point)}."
    return Plot("isobars", caption, figure)


def describe_point(point: WorkingPoint) -> str:
    """Return a working point as text in display units."""
    texts = (quantity_text(point.pressure, "Pa", "kPa"), contraction_text(point.contraction))
    return f"{', '.join(texts)}, {quantity_text(point.force, 'N', 'N')}"


def _draw_isobars(axes: Any, curves: Isobars, point: WorkingPoint | None, measured: Recording | None) -> None:
    """Draw the isobars, high pressures dark; `_draw_working_point` draws the isobar of the working point."""
    from matplotlib import colormaps
    from matplotlib.patheffects import withStroke

    shades = colormaps["viridis"](np.linspace(0.0, 0.85, curves.pressures.size))[::-1]
    for i in range(curves.pressures.size - 1, -1, -1):
        pressure, forces = curves.pressures[i], curves.forces[i]
        if (point is not None and np.isclose(pressure, point.pressure, atol=1.0)) or not (forces > 0).any():
            continue
        style: dict[str, Any] = {"color": shades[i], "label": quantity_text(pressure, "Pa", "kPa")}
        dashes: Any = DASHES[i % len(DASHES)]
        if measured is not None:
            rows = np.abs(measured["pressure"] - pressure) <= PRESSURE_TOLERANCE * curves.pressures.max()
            marker = {"marker": plotting.MARKERS[i % len(plotting.MARKERS)], "markersize": 4}
            points = {"linestyle": "none", "color": shades[i], "clip_on": False, "zorder": 3}
            if len(measured) > MANY_POINTS:  # a cloud of points under the lines of the model
                points |= {"markersize": 1.5, "alpha": 0.3, "zorder": 1.5}
            axes.plot(100 * measured["contraction"][rows], measured["force"][rows], **{**marker, **points})
            axes.plot([], [], linestyle="-", linewidth=1.4, **marker, **style)  # line and marker in the legend
            style["label"], dashes = "_nolegend_", "-"
            if len(measured) > MANY_POINTS:
                style |= {"path_effects": [withStroke(linewidth=3.0, foreground="white")], "zorder": 4}
        axes.plot(100 * curves.contractions, mask_slack(forces), linestyle=dashes, linewidth=1.4, **style)


def _shade_extrapolation(axes: Any, validity_range: ValidityRange, curves: Isobars) -> None:
    low, high = validity_range.contraction
    spans = [(curves.contractions[0], low), (high, curves.contractions[-1])]
    label = "outside the validity range"
    for start, end in spans:
        if end - start > 1e-9:
            axes.axvspan(100 * start, 100 * end, facecolor="0.5", alpha=0.16, linewidth=0, label=label)
            label = "_nolegend_"


def _force_axis_limit(curves: Isobars, point: WorkingPoint | None, measured: Recording | None) -> float:
    """Return the maximum of the force axis [N]: all curves unless a law diverges, and all points."""
    points = [point.force] if point is not None else []
    points += [float(np.nanmax(measured["force"]))] if measured is not None else []
    return max(force_axis_limit(curves), *points, 0.0)


def _draw_working_point(axes: Any, characteristic: Characteristic, curves: Isobars, point: WorkingPoint) -> None:
    forces = forces_along(characteristic, point.pressure, curves.contractions)
    axes.plot(
        100 * curves.contractions,
        mask_slack(forces),
        color=plotting.RED,
        linewidth=2.0,
        label=f"{quantity_text(point.pressure, 'Pa', 'kPa', 6)} (working point)",
        zorder=3,
    )
    axes.plot(
        [100 * point.contraction],
        [point.force],
        marker="o",
        markersize=7,
        markerfacecolor="white",
        markeredgecolor=plotting.RED,
        markeredgewidth=1.8,
        linestyle="none",
        label=f"working point\n{contraction_text(point.contraction)}, {quantity_text(point.force, 'N', 'N')}",
        zorder=4,
        clip_on=point.force < 0,
    )
