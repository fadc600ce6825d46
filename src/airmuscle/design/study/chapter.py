"""Report chapter of a parameter study, and its result files."""

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, ORANGE, RED, SKY, atomic_folder, cite, legend_below, new_figure
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.write import save_table, write_into
from .result import SobolIndices, StudyResult, sensitivity_table
from .study import Study

PANELS_PER_ROW = 3
MAX_POINTS = 2000
"""Maximum number of points of a scatter plot; of more runs, an equidistant subset is drawn."""
FEW_POINTS = 50
"""Number of points of a scatter plot up to which they are drawn large (chosen)."""
MAX_LABEL_LENGTH = 28
"""Number of letters that fit below a panel."""
_DISPLAY_UNITS = {
    "Pa": (1e-3, "kPa"), "Pa(a)": (1e-3, "kPa(a)"), "m": (1e3, "mm"), "m3": (1e6, "cm³"), "rad": (180 / math.pi, "deg"),
    "m3/(s Pa)": (1e8, "dm³/(s bar)"), "kg/s": (1e3, "g/s"), "1": (1.0, ""),
}  # fmt: skip
"""Factor and unit in which quantities with these SI units are displayed."""


def _shown(name: str, unit: str) -> tuple[float, str]:
    """Factor by which a quantity with an SI unit is displayed, and label of its axis, on two lines if it is long."""
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
    figure, axes = new_figure(rows, columns, width=width, height=height * rows, squeeze=False, **options)
    for axis in axes.flat[count:]:
        axis.set_visible(False)
    return figure, iter(axes.flat[:count])


def _histograms(result: StudyResult) -> Plot:
    study = result.study
    figure, panels = _panels(len(study.scalars))
    for name, axis in zip(study.scalars, panels, strict=True):
        factor, label = _shown(name, study.units[name])
        values = result[name][np.isfinite(result[name])] * factor
        axis.set(xlabel=label, ylabel="runs")
        axis.yaxis.get_major_locator().set_params(integer=True)
        if values.size:
            equal = np.ptp(values) <= 1e-12 * np.abs(values).max()
            bins = 1 if equal else min(60, max(4, math.ceil(2 * values.size ** (1 / 3))))  # Rice rule
            axis.hist(values, bins=bins, color=SKY, edgecolor="white", linewidth=0.4)
        else:
            axis.text(0.5, 0.5, "no values", ha="center", transform=axis.transAxes)
        if math.isfinite(result.nominal[name]):
            axis.axvline(result.nominal[name] * factor, color=RED, linestyle="--", linewidth=1.2)
    caption = "Histograms of the metrics over all runs; the dashed line is the nominal scenario."
    return Plot("histograms", caption, figure)


def _scatter(result: StudyResult, name: str) -> Plot:
    study = result.study
    figure, panels = _panels(len(study.parameters), sharey=True)
    factor, label = _shown(name, study.units[name])
    finite = np.flatnonzero(np.isfinite(result[name]))
    drawn = finite[:: max(1, -(-finite.size // MAX_POINTS))]
    few = drawn.size <= FEW_POINTS
    style = {"marker": "o", "linestyle": "none", "markersize": 5.0 if few else 2.4, "alpha": 0.9 if few else 0.5,
             "markeredgewidth": 0, "color": BLUE}  # fmt: skip
    for i, (parameter, axis) in enumerate(zip(study.parameters, panels, strict=True)):
        parameter_factor, parameter_label = _shown(parameter.path, parameter.unit)
        axis.plot(study.values[drawn, i] * parameter_factor, result[name][drawn] * factor, **style)
        axis.set_xlabel(parameter_label)
        axis.locator_params(axis="x", nbins=5)
        if i % PANELS_PER_ROW == 0:
            axis.set_ylabel(label)
    subset = f" {drawn.size} of {finite.size} runs are drawn." if drawn.size < finite.size else ""
    caption = f"{name} against each varied parameter, one point per run.{subset}"
    return Plot(f"scatter-{_file_stem(name)}", caption, figure)


def _sensitivity_bars(result: StudyResult, indices: dict[str, SobolIndices]) -> Plot:
    count, paths = len(indices), [parameter.path for parameter in result.study.parameters]
    figure, axes = new_figure(count, 1, height=0.8 + count * (0.7 + 0.42 * len(paths)), squeeze=False, sharex=True)
    rows = np.arange(len(paths))
    bar = {"height": 0.38, "error_kw": {"elinewidth": 0.9, "ecolor": BLACK, "capsize": 2}}
    for axis, (name, index) in zip(axes[:, 0], indices.items(), strict=True):
        for values, interval, shift, colour, label in (
            (index.first, index.first_interval, -0.2, BLUE, "first order"),
            (index.total, index.total_interval, 0.2, ORANGE, "total"),
        ):
            errors = np.abs(np.nan_to_num(interval - values))
            axis.barh(rows + shift, np.nan_to_num(values), xerr=errors, color=colour, label=label, **bar)
        axis.set_yticks(rows, paths)
        axis.invert_yaxis()
        axis.set_title(name if np.isfinite(index.total).any() else f"{name}: does not vary")
        axis.axvline(0.0, color=BLACK, linewidth=0.8)
        axis.grid(False, axis="y")
    axes[-1, 0].set_xlabel("fraction of the variance")
    legend_below(figure, axes[0, 0])
    caption = (
        "Variance-based sensitivities with 95 % bootstrap confidence intervals: first order (the parameter alone) and "
        "total (with its interactions)."
    )
    return Plot("sensitivities", caption, figure)


def _time_series_plot(result: StudyResult, name: str) -> Plot:
    study = result.study
    series, rows = study.time_series[name], result[name]
    factor, label = _shown(series.column, study.units[name])
    available = np.isfinite(rows).any(axis=0)
    low, median, high = quantiles = np.full((3, available.size), np.nan)
    if available.any():
        quantiles[:, available] = np.nanquantile(rows[:, available] * factor, [0.05, 0.5, 0.95], axis=0)
    figure, axis = new_figure()
    axis.fill_between(series.times, low, high, color=SKY, alpha=0.45, linewidth=0, label="5 % to 95 % of the runs")
    axis.plot(series.times, median, color=BLUE, label="median")
    axis.set(xlabel="time [s]", ylabel=label)
    legend_below(figure, axis)
    return Plot(f"time-series-{_file_stem(name)}", f"{name}: {series.column} over time, over all runs.", figure)


def _file_stem(name: str) -> str:
    """The name with all characters replaced that are not allowed in a file name."""
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in name)


RESULTS_FILE, TIME_SERIES_FILE = "results.csv", "time_series.npz"
MAX_LISTED_REASONS = 20
SHORT_LISTED = 4
"""Reasons of failed runs in the brief view (chosen)."""


def write_study(result: StudyResult, folder: Path | str, chapter: Chapter | None = None) -> Path:
    """Write results.csv, time_series.npz (if the study has time series) and the report; return the path of its page.

    The files are written atomically: all or none. `chapter` is that of the result, if it was made before. Raises
    FileError if the folder cannot be written to.
    """
    study = result.study
    with atomic_folder(folder) as place:
        save_table(result.table(), place / RESULTS_FILE)
        if study.time_series:
            times = {f"{name}_time": course.times for name, course in study.time_series.items()}
            np.savez(place / TIME_SERIES_FILE, **times, **result.time_series)  # type: ignore[arg-type]
        write_into(place, [chapter or study_chapter(result)], title="Parameter study")
    return Path(folder) / "report.html"


def study_chapter(result: StudyResult, *, execution: str = "") -> Chapter:
    """The report chapter: design, statistics, sensitivities and figures of a study.

    `execution` is a paragraph on the processes that have computed the runs.
    """
    study, indices = result.study, result.indices()
    plots = [_histograms(result), *(_scatter(result, name) for name in study.scalars)] if study.scalars else []
    plots += [_sensitivity_bars(result, indices)] if indices else []
    plots += [_time_series_plot(result, name) for name in study.time_series]
    tables = [result.statistics()] if study.scalars else []
    tables += [sensitivity_table(study, indices)] if indices else []
    tables += [failure_table(result)] if result.failed.size else []
    summary = [f"{len(study)} runs, {study.design}. {RESULTS_FILE} contains one row per run."]
    if study.time_series:
        names = ", ".join(study.time_series)
        summary.append(f"{TIME_SERIES_FILE} contains the time series ({names}), one row per run, and their times.")
    scenario = study.template.scenario
    metrics = [(f"metric {name}", str(metric), "study") for name, metric in study.metrics.items()]
    counts = {"runs": len(study), "failed runs": int(result.failed.size)}
    chosen = (
        ("scenario", scenario.title, str(study.path.name)), ("design", str(study.design), "study"), *metrics,
        ("integrator", str(scenario.problem.integrator), "scenario"),
        ("input signal", str(scenario.problem.input), "scenario"),
    )  # fmt: skip
    return Chapter(
        "study", study.title, (*summary, execution), plots=tuple(plots), tables=(*tables, variation_table(study)),
        values=tuple(NamedValue(name, count, brief=False) for name, count in counts.items()), chosen=chosen,
        notes=tuple(_notes(result, indices)), references=tuple(cite(scenario.plant)),
    )  # fmt: skip


def _notes(result: StudyResult, indices: dict[str, SobolIndices]) -> Iterator[str]:
    """Failed runs and excluded base points."""
    if result.failed.size:
        yield f"Failed runs: {result.failed.size}. They are excluded from the statistics; the table has the reasons."
    excluded = max((each.excluded_points for each in indices.values()), default=0)
    if excluded:
        yield f"Base points excluded from the sensitivities, because a metric is missing: {excluded}."


def variation_table(study: Study) -> Table:
    """The varied parameters with their distributions or levels and their sampled range."""
    columns: dict[str, Any] = {
        "parameter": [parameter.path for parameter in study.parameters],
        "values": list(map(str, study.variations)),
        "min": TableColumn(study.values.min(axis=0), BY_ROW),
        "max": TableColumn(study.values.max(axis=0), BY_ROW),
        "unit": [parameter.unit for parameter in study.parameters],
        "also applied to": [
            ", ".join(parameter.path for parameter, leader in study.follow if leader == i)
            for i in range(len(study.parameters))
        ],
    }
    return Table("varied", "Varied parameters", columns)


def failure_table(result: StudyResult) -> Table:
    """The reasons of failed runs, the most frequent first."""
    counts = Counter(result.failure_reasons[i] for i in result.failed).most_common(MAX_LISTED_REASONS)
    columns: dict[str, Any] = {
        "runs": [count for _, count in counts],
        "first run": [result.failure_reasons.index(reason) for reason, _ in counts],
        "reason": [reason for reason, _ in counts],
    }
    note = f"At most {MAX_LISTED_REASONS} reasons are listed." if len(counts) == MAX_LISTED_REASONS else ""
    return Table("failed", "Failed runs", columns, note, brief=SHORT_LISTED)
