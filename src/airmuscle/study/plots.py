"""The figures of a study: how outcomes are spread, how each goes with each input, and where its variance comes from."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.plotting import BLACK, BLUE, ORANGE, RED, SKY, legend_below, new_figure
from ..report.chapter import Plot
from .result import StudyResult
from .sensitivity import SobolIndices

PANELS_PER_ROW = 3
"""Panels beside each other."""
MAX_POINTS = 2000
"""Points of a scatter figure; of more runs every so many is drawn."""
MAX_LABEL_LENGTH = 28
"""Letters that fit under a panel."""
_DISPLAY_UNITS = {
    "Pa": (1e-3, "kPa"), "Pa(a)": (1e-3, "kPa(a)"), "m": (1e3, "mm"), "m3": (1e6, "cm³"), "rad": (180 / math.pi, "deg"),
    "m3/(s Pa)": (1e8, "dm³/(s bar)"), "kg/s": (1e3, "g/s"), "1": (1.0, ""),
}  # fmt: skip
"""Units that people read more easily than SI."""


def study_plots(result: StudyResult, indices: dict[str, SobolIndices]) -> tuple[Plot, ...]:
    """All figures of a study."""
    found = [_histograms(result)] if result.study.scalars else []
    found += [_scatter(result, name) for name in result.study.scalars]
    if indices:
        found.append(_sensitivity_bars(result, indices))
    return (*found, *(_time_series_plot(result, name) for name in result.study.time_series))


def display_scale(unit: str) -> tuple[float, str]:
    """The factor and the unit in which a quantity is shown."""
    return _DISPLAY_UNITS.get(unit, (1.0, unit))


def axis_label(name: str, unit: str) -> str:
    """What stands at an axis: the name and the unit, on two lines where they are long together."""
    shown = display_scale(unit)[1]
    if len(name) > MAX_LABEL_LENGTH:
        name = f"{name.rpartition('.')[0]}\n.{name.rpartition('.')[2]}"
    between = "\n" if len(name) + len(shown) > MAX_LABEL_LENGTH and "\n" not in name else " "
    return f"{name}{between}[{shown}]" if shown else name


def _panels(count: int, height: float = 2.3, **options: Any) -> tuple[Any, Iterator[Any]]:
    """A figure with as many panels, and these one after the other; places that are left over stay empty."""
    columns = min(count, PANELS_PER_ROW)
    rows = -(-count // columns)
    width = 3.4 if columns == 1 else 2.5 * columns
    figure, axes = new_figure(rows, columns, width=width, height=height * rows, squeeze=False, **options)
    for axis in axes.flat[count:]:
        axis.set_visible(False)
    return figure, iter(axes.flat[:count])


def _histograms(result: StudyResult) -> Plot:
    study = result.study
    figure, panels = _panels(len(study.scalars))
    for name, axis in zip(study.scalars, panels, strict=True):
        factor, _ = display_scale(study.units[name])
        values = result[name][np.isfinite(result[name])] * factor
        axis.set(xlabel=axis_label(name, study.units[name]), ylabel="runs")
        if values.size:
            axis.hist(values, bins=_bin_count(values), color=SKY, edgecolor="white", linewidth=0.4)
        else:
            axis.text(0.5, 0.5, "no run has it", ha="center", transform=axis.transAxes)
        if math.isfinite(result.nominal[name]):
            axis.axvline(result.nominal[name] * factor, color=RED, linestyle="--", linewidth=1.2)
    caption = "How the outcomes are spread over all runs; the dashed line is the scenario as it stands."
    return Plot("histograms", caption, figure)


def _bin_count(values: Array) -> int:
    """As many bins as the cube root of the number of runs says, twice over (rule of Rice); one where all are equal."""
    same = np.ptp(values) <= 1e-12 * np.abs(values).max()
    return 1 if same else min(60, max(4, math.ceil(2 * values.size ** (1 / 3))))


def _scatter(result: StudyResult, name: str) -> Plot:
    study = result.study
    figure, panels = _panels(len(study.parameters), sharey=True)
    factor, _ = display_scale(study.units[name])
    there = np.flatnonzero(np.isfinite(result[name]))
    drawn = there[:: max(1, -(-there.size // MAX_POINTS))]
    style = {"marker": "o", "linestyle": "none", "markersize": 2.4, "alpha": 0.5, "markeredgewidth": 0, "color": BLUE}
    for i, (number, axis) in enumerate(zip(study.parameters, panels, strict=True)):
        across, _ = display_scale(number.unit)
        axis.plot(study.values[drawn, i] * across, result[name][drawn] * factor, **style)
        axis.set_xlabel(axis_label(number.path, number.unit))
        axis.locator_params(axis="x", nbins=5)
        if i % PANELS_PER_ROW == 0:
            axis.set_ylabel(axis_label(name, study.units[name]))
    few = f" Of {there.size} runs {drawn.size} are drawn." if drawn.size < there.size else ""
    return Plot(f"scatter-{_file_stem(name)}", f"{name} against everything that varies, run by run.{few}", figure)


def _sensitivity_bars(result: StudyResult, indices: dict[str, SobolIndices]) -> Plot:
    study = result.study
    count, inputs = len(indices), [number.path for number in study.parameters]
    figure, axes = new_figure(
        count, 1, width=6.3, height=0.8 + count * (0.7 + 0.42 * len(inputs)), squeeze=False, sharex=True
    )
    places = np.arange(len(inputs))
    bar = {"height": 0.38, "error_kw": {"elinewidth": 0.9, "ecolor": BLACK, "capsize": 2}}
    for axis, (name, found) in zip(axes[:, 0], indices.items(), strict=True):
        for values, interval, shift, colour, words in (
            (found.first, found.first_interval, -0.2, BLUE, "first order"),
            (found.total, found.total_interval, 0.2, ORANGE, "total"),
        ):
            errors = np.abs(np.nan_to_num(interval - values))
            axis.barh(places + shift, np.nan_to_num(values), xerr=errors, color=colour, label=words, **bar)
        axis.set_yticks(places, inputs)
        axis.invert_yaxis()
        axis.set_title(name if np.isfinite(found.total).any() else f"{name}: does not vary")
        axis.axvline(0.0, color=BLACK, linewidth=0.8)
        axis.grid(False, axis="y")
    axes[-1, 0].set_xlabel("part of the variance")
    legend_below(figure, axes[0, 0])
    caption = "Variance-based sensitivities, with 95 % bootstrap intervals: what an input does alone, and in all."
    return Plot("sensitivities", caption, figure)


def _time_series_plot(result: StudyResult, name: str) -> Plot:
    study = result.study
    course, rows = study.time_series[name], result[name]
    factor, _ = display_scale(study.units[name])
    there = np.isfinite(rows).any(axis=0)
    low, middle, high = np.full((3, there.size), np.nan)
    if there.any():
        low[there], middle[there], high[there] = np.nanquantile(rows[:, there] * factor, [0.05, 0.5, 0.95], axis=0)
    figure, axis = new_figure()
    axis.fill_between(course.times, low, high, color=SKY, alpha=0.45, linewidth=0, label="5 % to 95 % of the runs")
    axis.plot(course.times, middle, color=BLUE, label="median")
    axis.set(xlabel="time [s]", ylabel=axis_label(course.column, study.units[name]))
    legend_below(figure, axis)
    return Plot(f"course-{_file_stem(name)}", f"{name}: {course.column} over time, over all runs.", figure)


def _file_stem(name: str) -> str:
    """A name that a file can have."""
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in name)
