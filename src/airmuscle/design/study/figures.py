"""Figures of a parameter study: histograms, scatter plots and time series of the metrics."""

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from ...core import BLUE, RED, SKY, Array, legend_below, new_figure
from ...report.chapter import Plot
from . import Study

PANELS_PER_ROW = 3
MAX_POINTS = 2000
"""Maximum number of points of a scatter plot; of more runs, an equidistant subset is drawn."""
FEW_POINTS = 50
"""Number of points of a scatter plot up to which they are drawn large (chosen)."""
MAX_LABEL_LENGTH = 28
"""Number of letters that fit below a panel."""
_DISPLAY_UNITS = {
    "Pa": (1e-3, "kPa"),
    "Pa(a)": (1e-3, "kPa(a)"),
    "m": (1e3, "mm"),
    "m3": (1e6, "cm³"),
    "rad": (180 / math.pi, "deg"),
    "m3/(s Pa)": (1e8, "dm³/(s bar)"),
    "kg/s": (1e3, "g/s"),
    "1": (1.0, ""),
}
"""Factor and unit in which quantities with these SI units are displayed."""


def _shown(name: str, unit: str) -> tuple[float, str]:
    """Factor by which a quantity with an SI unit is displayed, and label of its axis, on two lines
    if it is long.
    """
    factor, shown = _DISPLAY_UNITS.get(unit, (1.0, unit))
    if len(name) > MAX_LABEL_LENGTH:
        name = f"{name.rpartition('.')[0]}\n.{name.rpartition('.')[2]}"
    between = "\n" if len(name) + len(shown) > MAX_LABEL_LENGTH and "\n" not in name else " "
    return factor, f"{name}{between}[{shown}]" if shown else name


def _panels(count: int, height: float = 2.3, **options: Any) -> tuple[Any, Iterator[Any]]:
    """A figure with `count` panels, and an iterator over its axes; unused axes are hidden."""
    columns = min(count, PANELS_PER_ROW)
    rows = -(-count // columns)
    width = 3.4 if columns == 1 else 2.5 * columns
    figure, axes = new_figure(
        rows, columns, width=width, height=height * rows, squeeze=False, **options
    )
    for axis in axes.flat[count:]:
        axis.set_visible(False)
    return figure, iter(axes.flat[:count])


def histogram_figure(
    study: Study, metrics: Mapping[str, Array], nominal: Mapping[str, float]
) -> Any:
    """The histogram of each scalar metric over all runs, with its value of the nominal scenario."""
    figure, panels = _panels(len(study.scalars))
    for name, axis in zip(study.scalars, panels, strict=True):
        factor, label = _shown(name, study.units[name])
        values = metrics[name][np.isfinite(metrics[name])] * factor
        axis.set(xlabel=label, ylabel="runs")
        axis.yaxis.get_major_locator().set_params(integer=True)
        if values.size:
            equal = np.ptp(values) <= 1e-12 * np.abs(values).max()
            bins = (
                1 if equal else min(60, max(4, math.ceil(2 * values.size ** (1 / 3))))
            )  # Rice rule
            axis.hist(values, bins=bins, color=SKY, edgecolor="white", linewidth=0.4)
        else:
            axis.text(0.5, 0.5, "no values", ha="center", transform=axis.transAxes)
        if math.isfinite(nominal[name]):
            axis.axvline(nominal[name] * factor, color=RED, linestyle="--", linewidth=1.2)
    return figure


def scatter_plot(study: Study, name: str, values: Array) -> Plot:
    """A metric of all runs (N,) against each varied parameter."""
    finite = np.flatnonzero(np.isfinite(values))
    drawn = finite[:: max(1, -(-finite.size // MAX_POINTS))]
    subset = f" {drawn.size} of {finite.size} runs are drawn." if drawn.size < finite.size else ""
    caption = f"{name} against each varied parameter, one point per run.{subset}"
    return Plot(
        f"scatter-{file_stem(name)}", caption, partial(_scatter_figure, study, name, values, drawn)
    )


def _scatter_figure(study: Study, name: str, values: Array, drawn: Any) -> Any:
    figure, panels = _panels(len(study.parameters), sharey=True)
    factor, label = _shown(name, study.units[name])
    sparse = drawn.size <= FEW_POINTS
    style = {
        "marker": "o",
        "linestyle": "none",
        "markersize": 5.0 if sparse else 2.4,
        "alpha": 0.9 if sparse else 0.5,
        "markeredgewidth": 0,
        "color": BLUE,
    }
    for i, (parameter, axis) in enumerate(zip(study.parameters, panels, strict=True)):
        parameter_factor, parameter_label = _shown(parameter.path, parameter.unit)
        axis.plot(study.values[drawn, i] * parameter_factor, values[drawn] * factor, **style)
        axis.set_xlabel(parameter_label)
        axis.locator_params(axis="x", nbins=5)
        if i % PANELS_PER_ROW == 0:
            axis.set_ylabel(label)
    return figure


def time_series_figure(study: Study, name: str, rows: Array) -> Any:
    """Median and range of a time series of all runs (N, T)."""
    series = study.time_series[name]
    factor, label = _shown(series.column, study.units[name])
    available = np.isfinite(rows).any(axis=0)
    low, median, high = quantiles = np.full((3, available.size), np.nan)
    if available.any():
        quantiles[:, available] = np.nanquantile(
            rows[:, available] * factor, [0.05, 0.5, 0.95], axis=0
        )
    figure, axis = new_figure()
    axis.fill_between(
        series.times, low, high, color=SKY, alpha=0.45, linewidth=0, label="5 % to 95 % of the runs"
    )
    axis.plot(series.times, median, color=BLUE, label="median")
    axis.set(xlabel="time [s]", ylabel=label)
    legend_below(figure, axis)
    return figure


def file_stem(name: str) -> str:
    """The name with all characters replaced that are not allowed in a file name."""
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in name)
