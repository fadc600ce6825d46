"""The chart of a characteristic: force over contraction at constant pressures, with a working point on it."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..characteristic.base import Characteristic, ContractionLaw
from ..characteristic.validity_range import ValidityRange
from ..core import plotting
from ..core.arrays import Array
from ..core.errors import PhysicsError
from ..recording import Recording
from .chapter import Plot, Table

DASHES = plotting.DASHES[:5]
"""Those that stay apart on neighbouring curves."""
SAME_PRESSURE = 0.005
"""Part of the greatest pressure by which a measured point may miss an isobar and still be drawn with it (chosen)."""
STEEPEST = 8.0
"""The chart reaches to this multiple of the middle force, where a law grows beyond it (chosen)."""
POINTS, COARSE = 241, 61
"""Points on an isobar, and those on one of a law that is slow, or when looking for its ends."""


class Point(NamedTuple):
    """A working point: gauge pressure [Pa], contraction [1], tension [N]."""

    pressure: float
    contraction: float
    force: float


@dataclasses.dataclass(frozen=True, eq=False)
class Isobars:
    """Tensions (P, N) [N] at gauge pressures (P,) [Pa] over contractions (N,) [1]; NaN where there is none."""

    pressures: Array
    contractions: Array
    forces: Array


def validity_range_of(characteristic: Characteristic, stated: ValidityRange | None = None) -> ValidityRange | None:
    """Where a law may be trusted: the stated validity range, else the one it was fitted on, else None."""
    names = [field.name for field in dataclasses.fields(ValidityRange)]
    if stated is not None or not all(hasattr(characteristic, name) for name in names):
        return stated
    return ValidityRange(*(getattr(characteristic, name) for name in names))


def isobars(
    characteristic: Characteristic,
    validity_range: ValidityRange | None = None,
    point: Point | None = None,
    pressures: Array | None = None,
) -> Isobars:
    """The chart's curves, at round pressures over the validity range, or over the law's reach where there is none."""
    if pressures is None:
        pressures = _pressures(characteristic, validity_range, point)
    low, high = _contractions(characteristic, validity_range, point, pressures)
    contractions = np.linspace(low, high, POINTS if characteristic.traceable else COARSE)
    forces = [_forces(characteristic, float(pressure), contractions) for pressure in pressures]
    return Isobars(pressures, contractions, np.array(forces))


def table(curves: Isobars, name: str = "isobars") -> Table:
    """The isobars as a table, one column of tension a pressure."""
    columns = {
        f"force at {pressure / 1e3:.6g} kPa [N]": forces
        for pressure, forces in zip(curves.pressures, curves.forces, strict=True)
    }
    return Table(name, "Isobars", {"contraction [1]": curves.contractions, **columns}, "Gauge pressures.", shown=False)


def chart(
    characteristic: Characteristic,
    title: str,
    curves: Isobars,
    validity_range: ValidityRange | None = None,
    point: Point | None = None,
    measured: Recording | None = None,
) -> Plot:
    """The figure of the isobars; what lies outside the validity range is shaded, the working point marked and labelled.

    `measured` points are drawn with the curve of their pressure.
    """
    figure, axes = plotting.new_figure()
    _draw_isobars(axes, curves, point, measured)
    if validity_range is not None:
        _shade_outside(axes, validity_range, curves)
    if point is not None:
        _mark(axes, characteristic, curves, point)
    axes.set(
        xlabel="contraction [%]",
        ylabel="force [N]",
        xlim=(100 * curves.contractions[0], 100 * curves.contractions[-1]),
        ylim=(0.0, 1.06 * _max_force(curves, point, measured)),
    )
    axes.set_title(textwrap.fill(title, 60), fontsize=9)
    plotting.legend_outside(axes, title="gauge pressure")
    caption = f"{title}: force over contraction at constant gauge pressure."
    if point is not None:
        caption += f" Working point: {point_text(point)}."
    return Plot("isobars", caption, figure)


def point_text(point: Point) -> str:
    """A working point in the units that a bench uses."""
    return f"{point.pressure / 1e3:.4g} kPa, {point.contraction:.2%}, {point.force:.4g} N"


def _draw_isobars(axes: Any, curves: Isobars, point: Point | None, measured: Recording | None) -> None:
    """Dark for high pressure; dashes and markers tell them apart in grey. The point's isobar is left to `_mark`."""
    from matplotlib import colormaps

    shades = colormaps["viridis"](np.linspace(0.0, 0.85, curves.pressures.size))[::-1]
    for i in range(curves.pressures.size - 1, -1, -1):
        pressure, forces = curves.pressures[i], curves.forces[i]
        if (point is not None and np.isclose(pressure, point.pressure, atol=1.0)) or not (forces > 0).any():
            continue
        style: dict[str, Any] = {"color": shades[i], "label": f"{pressure / 1e3:.4g} kPa"}
        dashes: Any = DASHES[i % len(DASHES)]
        if measured is not None:
            near = np.abs(measured["pressure"] - pressure) <= SAME_PRESSURE * curves.pressures.max()
            marker = {"marker": plotting.MARKERS[i % len(plotting.MARKERS)], "markersize": 4}
            at = {"linestyle": "none", "color": shades[i], "clip_on": False, "zorder": 3}
            axes.plot(100 * measured["contraction"][near], measured["force"][near], **marker, **at)
            axes.plot([], [], linestyle="-", linewidth=1.4, **marker, **style)  # line and marker in the legend
            style["label"], dashes = "_nolegend_", "-"
        axes.plot(100 * curves.contractions, _until_slack(forces), linestyle=dashes, linewidth=1.4, **style)


def _until_slack(forces: Array) -> Array:
    """The curve up to where the muscle goes slack; a law clamped at zero would draw along the axis from there on."""
    slack = np.flatnonzero(forces == 0.0)
    after = np.arange(forces.size) > (slack[0] if slack.size else forces.size)
    return np.where(after & (forces == 0.0), np.nan, forces)


def _shade_outside(axes: Any, validity_range: ValidityRange, curves: Isobars) -> None:
    low, high = validity_range.contraction
    spans = [(curves.contractions[0], low), (high, curves.contractions[-1])]
    label = "outside the valid range"
    for start, end in spans:
        if end - start > 1e-9:
            axes.axvspan(100 * start, 100 * end, facecolor="0.5", alpha=0.16, linewidth=0, label=label)
            label = "_nolegend_"


def _max_force(curves: Isobars, point: Point | None, measured: Recording | None) -> float:
    """The chart's height: all curves, unless a law grows beyond bounds somewhere, and certainly every point."""
    pulling = curves.forces[curves.forces > 0]
    usual = STEEPEST * float(np.median(pulling)) if pulling.size else 1.0
    points = [point.force] if point is not None else []
    points += [float(np.nanmax(measured["force"]))] if measured is not None else []
    return max(1e-9, min(usual, float(pulling.max(initial=0.0))), *points)


def _mark(axes: Any, characteristic: Characteristic, curves: Isobars, point: Point) -> None:
    own = _forces(characteristic, point.pressure, curves.contractions)
    axes.plot(
        100 * curves.contractions,
        _until_slack(own),
        color=plotting.RED,
        linewidth=2.0,
        label=f"{point.pressure / 1e3:.6g} kPa (given)",
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
        label=f"working point\n{point.contraction:.2%}, {point.force:.4g} N",
        zorder=4,
        clip_on=point.force < 0,
    )


def _pressures(characteristic: Characteristic, validity_range: ValidityRange | None, point: Point | None) -> Array:
    """Round pressures over the validity range; where there is none, to twice the working point, or over the law's reach."""
    if validity_range is not None:
        return _round_steps(*validity_range.pressure)
    low, high = characteristic.pressure_range
    near = 2.0 * point.pressure if point is not None and point.pressure > low else high
    return _round_steps(low, min(near, high))


def _round_steps(low: float, high: float) -> Array:
    """About seven round pressures from low to high, both ends among them where they are round."""
    from matplotlib.ticker import MaxNLocator

    ticks = np.asarray(MaxNLocator(nbins=7, steps=[1, 2, 5, 10]).tick_values(low, high), dtype=float)
    margin = 1e-9 * (high - low)
    inside: Array = ticks[(ticks >= low - margin) & (ticks <= high + margin)]
    return inside if inside.size > 1 else np.array([low, high])


def _contractions(
    characteristic: Characteristic, validity_range: ValidityRange | None, point: Point | None, pressures: Array
) -> tuple[float, float]:
    """The chart's width: a tenth more than the validity range, or as far as the muscle pulls at any of the pressures."""
    if validity_range is not None:
        low, high = validity_range.contraction
        low, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    else:
        low, high = characteristic.contraction_range
        grid = np.linspace(low, high, COARSE)
        forces = np.array([_forces(characteristic, float(pressure), grid) for pressure in pressures])
        pulling = np.flatnonzero((np.nan_to_num(forces) > 0).any(axis=0))
        if pulling.size:
            low, high = float(grid[pulling[0]]), float(grid[min(pulling[-1] + 2, COARSE - 1)])
    reach = characteristic.contraction_range
    low, high = max(low, reach[0]), min(high, reach[1])
    return (min(low, point.contraction), max(high, point.contraction)) if point else (low, high)


def _forces(characteristic: Characteristic, pressure: float, contractions: Array) -> Array:
    """The tension along an isobar; NaN where the law has none, or would push."""
    if isinstance(characteristic, ContractionLaw):
        return _from_contractions(characteristic, pressure, contractions)
    forces = _wherever(lambda c: np.asarray(characteristic.force(pressure, c)) + 0.0 * c, contractions)
    return np.where(np.isfinite(forces) & (forces >= 0), forces, np.nan)


def _from_contractions(characteristic: ContractionLaw, pressure: float, contractions: Array) -> Array:
    """A law that gives contraction is asked at a range of forces, which needs no search, and read backwards."""
    forces = np.linspace(*characteristic.force_range, 4 * POINTS)
    found = _wherever(lambda force: np.asarray(characteristic.contraction(pressure, force)), forces)
    known = np.isfinite(found)
    found, forces = found[known], forces[known]
    falling = np.append(True, np.diff(np.minimum.accumulate(found)) < 0)[: found.size]
    if falling.sum() < 2:
        return np.full(contractions.shape, np.nan)
    along: Array = np.interp(contractions, found[falling][::-1], forces[falling][::-1], left=np.nan, right=np.nan)
    return along


def _wherever(law: Callable[[Array], Array], places: Array) -> Array:
    """The law at every place where it has a value; NaN elsewhere. Halves until it finds where there is none."""
    try:
        with np.errstate(all="ignore"):  # a law may have no value at the end of its reach
            return np.asarray(law(places), dtype=float)
    except PhysicsError:
        if places.size == 1:
            return np.array([np.nan])
    middle = places.size // 2
    return np.concatenate([_wherever(law, places[:middle]), _wherever(law, places[middle:])])
