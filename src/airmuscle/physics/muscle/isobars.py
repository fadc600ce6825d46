"""Isobars of a characteristic, tension over contraction at constant gauge pressures: chart and
figure.
"""

import dataclasses
import textwrap
from typing import Any

import numpy as np

from ...core import Array, chosen_scale, contraction_text, new_figure, plotting, quantity_text
from ...recording import Recording
from .characteristic import (
    Characteristic,
    ContractionLaw,
    ValidityRange,
    validity_range_of,
    values_or_nan,
)
from .working_point import WorkingPoint

MAX_FORCE_RATIO = 8.0
"""Maximum of the force axis as a multiple of the median force, for laws that diverge (chosen)."""
PRESSURE_TOLERANCE = 0.005
"""Maximum difference between a measured point and its isobar, as a fraction of the maximum pressure
(chosen).
"""
MANY_POINTS = 500
"""Number of measured rows above which they are a cloud under the lines of the model (chosen)."""
POINTS = 241
COARSE_POINTS = 61
"""Points of an isobar; points for a law that is slow to evaluate, and for the search of the
contraction range.
"""
CHART_PRESSURES = 6
"""Number of isobars in the chart of a law without a validity range."""
CHART_MAX_PRESSURE = 6e5
"""Maximum gauge pressure [Pa] in the chart of a law without a validity range (chosen)."""
MAX_TITLE_LINES = 3
"""Maximum number of lines of a title; the rest is left out."""


@dataclasses.dataclass(frozen=True, eq=False)
class Isobars:
    """Tensions, shape (P, N) [N], at gauge pressures (P,) [Pa] and contractions (N,) [1]; NaN where
    undefined.
    """

    pressures: Array
    contractions: Array
    forces: Array


def compute_isobars(
    characteristic: Characteristic,
    validity_range: ValidityRange | None = None,
    point: WorkingPoint | None = None,
    pressures: Array | None = None,
) -> Isobars:
    """Return isobars at the given pressures [Pa].

    None stands for round pressures over the validity range; without one up to twice the pressure of
    the working point, or over the law's pressure range.
    """
    from matplotlib.ticker import MaxNLocator

    if pressures is None:
        low, high = validity_range.pressure if validity_range else characteristic.pressure_range
        if validity_range is None and point is not None and point.pressure > low:
            high = min(2.0 * point.pressure, high)
        # about seven round pressures from low to high, including the ends if they are round
        ticks = np.asarray(
            MaxNLocator(nbins=7, steps=[1, 2, 5, 10]).tick_values(low, high), dtype=float
        )
        margin = 1e-9 * (high - low)
        inside = ticks[(ticks >= low - margin) & (ticks <= high + margin)]
        pressures = inside if inside.size > 1 else np.array([low, high])
    low, high = _contraction_axis(characteristic, validity_range, point, pressures)
    contractions = np.linspace(low, high, POINTS if characteristic.traceable else COARSE_POINTS)
    forces = [forces_along(characteristic, float(pressure), contractions) for pressure in pressures]
    return Isobars(pressures, contractions, np.array(forces))


def axis_scales() -> tuple[tuple[float, str], tuple[float, str]]:
    """Factor from SI and unit of the contraction and of the force in a chart."""
    return chosen_scale("1", 100.0, "%"), chosen_scale("N", 1.0, "N")


def draw_isobars(
    axes: Any,
    curves: Isobars,
    title: str,
    point: WorkingPoint | None = None,
    measured: Recording | None = None,
) -> None:
    """Draw isobars into Matplotlib axes, high pressures dark, without a legend.

    Measured points have the colour of the curve of their pressure. That of a working point is left
    to the caller.
    """
    from matplotlib import colormaps
    from matplotlib.patheffects import withStroke

    (across, unit), (up, force_unit) = axis_scales()
    shades = colormaps["viridis"](np.linspace(0.0, 0.85, curves.pressures.size))[::-1]
    for i in range(curves.pressures.size - 1, -1, -1):
        pressure = curves.pressures[i]
        forces = curves.forces[i]
        if (point is not None and np.isclose(pressure, point.pressure, atol=1.0)) or not (
            forces > 0
        ).any():
            continue
        style: dict[str, Any] = {
            "color": shades[i],
            "label": quantity_text(pressure, "Pa", "kPa"),
            "linewidth": 1.4,
        }
        dashes: Any = plotting.DASHES[i % 5]
        if measured is not None:
            rows = (
                np.abs(measured["pressure"] - pressure)
                <= PRESSURE_TOLERANCE * curves.pressures.max()
            )
            marker = {"marker": plotting.MARKERS[i % len(plotting.MARKERS)], "markersize": 4}
            points = {"linestyle": "none", "color": shades[i], "clip_on": False, "zorder": 3}
            if len(measured) > MANY_POINTS:  # a cloud of points under the lines of the model
                points |= {"markersize": 1.5, "alpha": 0.3, "zorder": 1.5}
            axes.plot(
                across * measured["contraction"][rows],
                up * measured["force"][rows],
                **{**marker, **points},
            )
            axes.plot([], [], linestyle="-", **marker, **style)  # line and marker in the legend
            style["label"] = "_nolegend_"
            dashes = "-"
            if len(measured) > MANY_POINTS:
                style |= {
                    "path_effects": [withStroke(linewidth=3.0, foreground="white")],
                    "zorder": 4,
                }
        axes.plot(across * curves.contractions, up * mask_slack(forces), linestyle=dashes, **style)
    axes.set(
        xlabel=f"contraction [{'-' if unit == '1' else unit}]",
        ylabel=f"force [{force_unit}]",
        xlim=(across * curves.contractions[0], across * curves.contractions[-1]),
        ylim=(0.0, 1.06 * up * _force_axis_limit(curves, point, measured)),
    )
    axes.set_title(title, fontsize=9)


def mask_slack(forces: Array) -> Array:
    """Return the forces with NaN beyond the point where the muscle becomes slack, where a clamped
    law is zero.
    """
    slack = np.flatnonzero(forces == 0.0)
    after = np.arange(forces.size) > (slack[0] if slack.size else forces.size)
    return np.where(after & (forces == 0.0), np.nan, forces)


def _force_axis_limit(
    curves: Isobars, point: WorkingPoint | None, measured: Recording | None
) -> float:
    """The maximum of the force axis [N]: all curves unless a law diverges, and all points."""
    pulling = curves.forces[curves.forces > 0]
    limit = MAX_FORCE_RATIO * float(np.median(pulling)) if pulling.size else 1.0
    points = [point.force] if point is not None else []
    points += [float(np.nanmax(measured["force"]))] if measured is not None else []
    return max(1e-9, min(limit, float(pulling.max(initial=0.0))), *points)


def _contraction_axis(
    characteristic: Characteristic,
    validity_range: ValidityRange | None,
    point: WorkingPoint | None,
    pressures: Array,
) -> tuple[float, float]:
    """Return the limits of the contraction axis [1].

    They exceed the validity range by a tenth; without one they include all contractions with a
    positive force.
    """
    if validity_range is not None:
        low, high = validity_range.contraction
        low, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    else:
        low, high = characteristic.contraction_range
        grid = np.linspace(low, high, COARSE_POINTS)
        forces = np.array(
            [forces_along(characteristic, float(pressure), grid) for pressure in pressures]
        )
        pulling = np.flatnonzero((np.nan_to_num(forces) > 0).any(axis=0))
        if pulling.size:
            low = float(grid[pulling[0]])
            high = float(grid[min(pulling[-1] + 2, COARSE_POINTS - 1)])
    lower_limit, upper_limit = characteristic.contraction_range
    low = max(low, lower_limit)
    high = min(high, upper_limit)
    return (min(low, point.contraction), max(high, point.contraction)) if point else (low, high)


def forces_along(characteristic: Characteristic, pressure: float, contractions: Array) -> Array:
    """The tension [N] along an isobar at a gauge pressure [Pa] and contractions (N,).

    It is NaN where the law is undefined or the tension negative.
    """
    if not isinstance(characteristic, ContractionLaw):
        forces = values_or_nan(lambda c: characteristic.force(pressure, c), contractions)
        return np.where(np.isfinite(forces) & (forces >= 0), forces, np.nan)
    # by interpolation of the inverse, without a search
    forces = np.linspace(*characteristic.force_range, 4 * POINTS)
    values = values_or_nan(lambda force: characteristic.contraction(pressure, force), forces)
    finite = np.isfinite(values)
    values = values[finite]
    forces = forces[finite]
    falling = np.append(True, np.diff(np.minimum.accumulate(values)) < 0)[: values.size]
    if falling.sum() < 2:
        return np.full(contractions.shape, np.nan)
    inverse: Array = np.interp(
        contractions, values[falling][::-1], forces[falling][::-1], left=np.nan, right=np.nan
    )
    return inverse


def isobar_figure(
    characteristic: Characteristic,
    title: str,
    curves: Isobars,
    validity_range: ValidityRange | None = None,
    point: WorkingPoint | None = None,
    measured: Recording | None = None,
) -> Any:
    """Return the figure of the isobars: shaded outside the validity range, with the working point
    if one is given.

    `measured` points are drawn with the curve of the same pressure.
    """
    figure, axes = new_figure()
    (across, _), (up, _) = axis_scales()
    draw_isobars(
        axes,
        curves,
        textwrap.fill(title, 60, max_lines=MAX_TITLE_LINES, placeholder=" …"),
        point,
        measured,
    )
    if validity_range is not None:
        low, high = validity_range.contraction
        label = "outside the validity range"
        for start, end in ((curves.contractions[0], low), (high, curves.contractions[-1])):
            if end - start > 1e-9:
                axes.axvspan(
                    across * start,
                    across * end,
                    facecolor="0.5",
                    alpha=0.16,
                    linewidth=0,
                    label=label,
                )
                label = "_nolegend_"
    if point is not None:
        forces = forces_along(characteristic, point.pressure, curves.contractions)
        label = f"{quantity_text(point.pressure, 'Pa', 'kPa', 6)} (working point)"
        line = {"color": plotting.RED, "linewidth": 2.0, "label": label, "zorder": 3}
        axes.plot(across * curves.contractions, up * mask_slack(forces), **line)
        label = (
            f"working point\n{contraction_text(point.contraction)},"
            f" {quantity_text(point.force, 'N', 'N')}"
        )
        ring = {
            "marker": "o",
            "markersize": 7,
            "markerfacecolor": "white",
            "markeredgecolor": plotting.RED,
        }
        style = {
            "linestyle": "none",
            "markeredgewidth": 1.8,
            "label": label,
            "zorder": 4,
            "clip_on": point.force < 0,
        }
        axes.plot([across * point.contraction], [up * point.force], **ring, **style)
    plotting.legend_outside(axes, title="gauge pressure")
    return figure


def plot_isobars(
    law: Characteristic,
    title: str,
    validity_range: ValidityRange | None = None,
    *,
    pressures: Any = None,
    ax: Any = None,
) -> Any:
    """Plot the tension of a law over the contraction at constant gauge pressures [Pa], by default
    round ones.

    `ax` is a Matplotlib Axes and is returned; without it a new figure is returned. Raises
    ParameterError.
    """
    known = validity_range_of(law, validity_range)
    if pressures is None and known is None:
        pressures = np.linspace(0.0, CHART_MAX_PRESSURE, CHART_PRESSURES + 1)[1:]
    given: Array | None = (
        None if pressures is None else np.atleast_1d(np.asarray(pressures, dtype=float))
    )
    curves = compute_isobars(law, known, pressures=given)
    if ax is None:
        shown, axes = new_figure(height=3.0)
        title = textwrap.shorten(title, 90, placeholder=" …")
    else:
        shown = ax
        axes = plotting.given_axes(ax, 1, "plot of a muscle")[0]
    draw_isobars(axes, curves, title)
    plotting.legend_outside(axes, title="gauge pressure")
    return shown
