"""Isobar plot of a characteristic, with an optional working point; display of a muscle with its isobars and parts."""

import dataclasses
import textwrap
from typing import Any

import numpy as np

from ...core import Array, contraction_text, given_axes, legend_outside, new_figure, plotting, quantity_text
from ...recording import Recording
from .characteristic import Characteristic, ValidityRange, validity_range_of
from .isobars import Isobars, WorkingPoint, axis_scales, compute_isobars, draw_isobars, forces_along, mask_slack

PARAMETERS = ("parameter", "symbol", "value", "unit", "meaning")
"""Header of a table of parameters."""
CHART_PRESSURES = 6
"""Number of isobars in the chart of a law without a validity range."""
CHART_MAX_PRESSURE = 6e5
"""Maximum gauge pressure [Pa] in the chart of a law without a validity range (chosen)."""
MAX_TITLE_LINES = 3
"""Maximum number of lines of a title; the rest is left out."""


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


def plot_isobars(
    law: Characteristic,
    title: str,
    validity_range: ValidityRange | None = None,
    *,
    pressures: Any = None,
    ax: Any = None,
) -> Any:
    """Plot the tension of a law over the contraction at constant gauge pressures [Pa], by default round ones.

    `ax` is a Matplotlib Axes and is returned; without it a new figure is returned. Raises ParameterError.
    """
    known = validity_range_of(law, validity_range)
    if pressures is None and known is None:
        pressures = np.linspace(0.0, CHART_MAX_PRESSURE, CHART_PRESSURES + 1)[1:]
    given: Array | None = None if pressures is None else np.atleast_1d(np.asarray(pressures, dtype=float))
    curves = compute_isobars(law, known, pressures=given)
    if ax is None:
        shown, axes = new_figure(height=3.0)
        title = textwrap.shorten(title, 90, placeholder=" …")
    else:
        shown, axes = ax, given_axes(ax, 1, "plot of a muscle")[0]
    draw_isobars(axes, curves, title)
    legend_outside(axes, title="gauge pressure")
    return shown


def component_rows(muscle: Any) -> list[tuple[str, ...]]:
    """Rows with the components of a muscle: its law with its range, its size, and the optional elements it has."""
    rows: list[tuple[str, ...]] = [("contractile element", type(muscle.contractile).__name__)]
    rows.append(("geometry", type(muscle.geometry).__name__))
    rows.append(("resting length", quantity_text(muscle.geometry.resting_length, "m", "mm")))
    if (known := validity_range_of(muscle.contractile, muscle.validity_range)) is not None:
        (low, high), (least, most) = known.pressure, known.contraction
        rows.append(("valid gauge pressure", " to ".join(quantity_text(p, "Pa", "kPa") for p in (low, high))))
        rows.append(("valid contraction", " to ".join(contraction_text(c) for c in (least, most))))
    default = {f.name: f.default for f in dataclasses.fields(muscle)}
    for name in ("spring", "damper", "friction", "wall", "series", "stop", "creep"):
        if (part := getattr(muscle, name)) != default[name]:
            rows.append((name, textwrap.shorten(str(part), 100, placeholder=" …")))
    return rows
