"""Isobar plot of a characteristic: force over contraction at constant pressures, with an optional working point."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import Any

from ...core import plotting
from ...core.display import contraction_text, quantity_text
from ...recording import Recording
from ...report.chapter import Plot, Table, TableColumn
from .characteristic.base import Characteristic
from .characteristic.validity_range import ValidityRange
from .isobars import Isobars, WorkingPoint, axis_scales, draw_isobars, forces_along, mask_slack

MAX_TITLE_LINES = 3
"""Maximum number of lines of a title; the rest is left out."""


def isobar_table(curves: Isobars, name: str = "isobars") -> Table:
    """Return the isobars as a table with one column of tensions per pressure."""
    columns = {
        f"force at {pressure / 1e3:.6g} kPa": TableColumn(forces, "N")
        for pressure, forces in zip(curves.pressures, curves.forces, strict=True)
    }
    first = {"contraction": TableColumn(curves.contractions, "1")}
    return Table(name, "Isobars", {**first, **columns}, "Gauge pressures.", series=True)


def isobar_plot(
    characteristic: Characteristic,
    title: str,
    curves: Isobars | Callable[[], Isobars],
    validity_range: ValidityRange | None = None,
    point: WorkingPoint | None = None,
    measured: Recording | None = None,
) -> Plot:
    """Return the plot of the isobars, or of those that a function computes when it is drawn."""

    def draw() -> Any:
        drawn = curves() if callable(curves) else curves
        return isobar_figure(characteristic, title, drawn, validity_range, point, measured)

    caption = f"{title}: force over contraction at constant gauge pressure."
    if point is not None:
        caption += f" Working point: {describe_point(point)}."
    return Plot("isobars", caption, draw)


def isobar_figure(
    characteristic: Characteristic,
    title: str,
    curves: Isobars,
    validity_range: ValidityRange | None = None,
    point: WorkingPoint | None = None,
    measured: Recording | None = None,
) -> Any:
    """Return the figure of the isobars: shaded outside the validity range, with the working point if one is given.

    `measured` points are drawn with the curve of the same pressure.
    """
    figure, axes = plotting.new_figure()
    draw_isobars(axes, curves, textwrap.fill(title, 60, max_lines=MAX_TITLE_LINES, placeholder=" …"), point, measured)
    if validity_range is not None:
        _shade_extrapolation(axes, validity_range, curves)
    if point is not None:
        _draw_working_point(axes, characteristic, curves, point)
    plotting.legend_outside(axes, title="gauge pressure")
    return figure


def describe_point(point: WorkingPoint) -> str:
    """Return a working point as text in display units."""
    texts = (quantity_text(point.pressure, "Pa", "kPa"), contraction_text(point.contraction))
    return f"{', '.join(texts)}, {quantity_text(point.force, 'N', 'N')}"


def _shade_extrapolation(axes: Any, validity_range: ValidityRange, curves: Isobars) -> None:
    (across, _), _ = axis_scales()
    low, high = validity_range.contraction
    spans = [(curves.contractions[0], low), (high, curves.contractions[-1])]
    label = "outside the validity range"
    for start, end in spans:
        if end - start > 1e-9:
            axes.axvspan(across * start, across * end, facecolor="0.5", alpha=0.16, linewidth=0, label=label)
            label = "_nolegend_"


def _draw_working_point(axes: Any, characteristic: Characteristic, curves: Isobars, point: WorkingPoint) -> None:
    forces = forces_along(characteristic, point.pressure, curves.contractions)
    (across, _), (up, _) = axis_scales()
    axes.plot(
        across * curves.contractions,
        up * mask_slack(forces),
        color=plotting.RED,
        linewidth=2.0,
        label=f"{quantity_text(point.pressure, 'Pa', 'kPa', 6)} (working point)",
        zorder=3,
    )
    axes.plot(
        [across * point.contraction],
        [up * point.force],
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
