"""Report chapters: a dynamic fit with estimates, identifiability, profiles, and measured and
modelled records.
"""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, RED, Array, cite, legend_below, new_figure
from ...recording.columns import display_scale, displayed
from ...report.chapter import BY_ROW, Chapter, Plot, Table, TableColumn
from ...report.shown import BRIEF_ROWS
from ..reported import unit_column
from .fit import CrossPrediction, describe_cross_predictions
from .regulator_fit import RegulatorFit
from .result import MIN_IMPROVEMENT, NORMAL_95, DynamicFit, DynamicProfile

MAX_OPTIMA = 8
"""Maximum number of optima in a table; the lowest are shown."""


def dynamic_chapters(
    fit: DynamicFit,
    title: str,
    profiles: Sequence[DynamicProfile] = (),
    remarks: Sequence[str] = (),
    cross: Sequence[CrossPrediction] = (),
) -> list[Chapter]:
    """Return the chapters of a dynamic fit: estimates and identifiability, profiles, and one
    chapter per record. `remarks` are sentences about the records, `cross` the predictions of each
    record by the others, which stand first."""
    first = _estimates(fit, title, remarks, cross)
    records = range(len(fit.problem.record_models))
    return [
        first,
        *([_profiles(profiles)] if profiles else []),
        *(_record(fit, i) for i in records),
    ]


def regulator_chapters(result: RegulatorFit, title: str) -> list[Chapter]:
    """Return the chapters of the fit of a pressure regulator, as those of a dynamic fit."""
    first = _estimates(result.fit, title, (), ())
    chapter = result.chapter()
    records = [_record(result.fit, i) for i in range(len(result.zeros))]
    return [
        dataclasses.replace(first, tables=(*first.tables, chapter.tables[-1]), notes=chapter.notes),
        *records,
    ]


def _estimates(
    fit: DynamicFit, title: str, remarks: Sequence[str], cross: Sequence[CrossPrediction]
) -> Chapter:
    chapter = fit.chapter()
    estimates, residuals = chapter.tables
    if cross:  # the table of the cross-predictions contains the residuals, too
        residuals = dataclasses.replace(residuals, brief=0)
    names = [e.name for e in fit.estimates]
    undetermined = fit.identifiability.undetermined
    rows = {"unknown": names, **{name: fit.correlations[:, i] for i, name in enumerate(names)}}
    correlations = Table("correlations", "Correlations", rows, shown=False)
    columns: dict[str, Any] = {
        "combination (relative changes)": [
            ", ".join(f"{name} {share:+.2g}" for name, share in combination.shares)
            for combination in undetermined
        ],
        "relative standard deviation": [
            combination.relative_stderr for combination in undetermined
        ],
        "experiment that determines it": [combination.remedy for combination in undetermined],
    }
    open_ends = Table(
        "not-determined", "Parameter combinations that the records do not determine", columns
    )
    tables = (
        _cross_table(cross),
        estimates,
        open_ends,
        _optima_table(fit),
        residuals,
        correlations,
    )
    return dataclasses.replace(
        chapter,
        title=title,
        summary=(describe_cross_predictions(cross), *chapter.paragraphs),
        tables=tuple(filter(len, tables)),
        plots=(),
        notes=(*chapter.notes, *remarks),
        references=tuple(cite(fit.plant())),
    )


def _cross_table(cross: Sequence[CrossPrediction]) -> Table:
    pairs = [(prediction, name) for prediction in cross for name in prediction.rms]
    errors = [prediction.rms[name] for prediction, name in pairs]
    residuals = [prediction.fitted[name] for prediction, name in pairs]
    columns: dict[str, Any] = {
        "record": [prediction.record for prediction, _ in pairs],
        "quantity": [name for _, name in pairs],
        "rms error, predicted by the others": TableColumn(errors, BY_ROW, short="rms error"),
        "rms residual of the joint fit": TableColumn(residuals, BY_ROW, short="joint fit"),
        "unit": unit_column([name for _, name in pairs]),
    }
    title = "Each record predicted by the parameters of the others"
    return Table("cross", title, columns, brief=BRIEF_ROWS, key="cross-predictions")


def _optima_table(fit: DynamicFit) -> Table:
    """Return a table of the optima of the searches with their estimates; empty unless there are
    several.
    """
    shown = fit.optima[:MAX_OPTIMA] if len(fit.optima) > 1 else ()
    lowest = max(fit.costs[0], 1e-300)
    columns: dict[str, Any] = {
        "searches": [optimum.searches for optimum in shown],
        "rms residual relative to the lowest": [
            float(np.sqrt(optimum.cost / lowest)) for optimum in shown
        ],
    }
    for i, estimate in enumerate(fit.estimates):
        columns[estimate.name] = TableColumn(
            [float(optimum.values[i]) for optimum in shown], estimate.unit
        )
    return Table("optima", "Optima of the searches", columns)


def _profiles(profiles: Sequence[DynamicProfile]) -> Chapter:
    columns: dict[str, Any] = {
        "parameter": [p.name for p in profiles],
        "95 % interval": TableColumn([p.interval for p in profiles], BY_ROW),
        "unit": [p.unit for p in profiles],
    }
    rows = [(p, k) for p in profiles for k in range(len(p.values))]
    courses: dict[str, Any] = {
        "parameter": [p.name for p, _ in rows],
        "value": TableColumn([float(p.values[k]) for p, k in rows], BY_ROW),
        "increase of the sum of squares": [float(p.cost_increase[k]) for p, k in rows],
        "unit": [p.unit for p, _ in rows],
    }
    summary = (
        "One parameter is fixed at a series of values and all others are estimated again. An end is"
        " missing if the sum of squares does not rise enough within these values: the records do"
        " not limit the parameter there."
    )
    tables = (
        Table("profiles", "95 % intervals", columns, brief=BRIEF_ROWS),
        Table(
            "profile-courses",
            "Increase of the sum of squares [residual variances]",
            courses,
            shown=False,
        ),
    )
    caption = "Increase of the sum of squares; dashed: limit of the 95 % interval."
    plots = (Plot("profiles", caption, partial(_profile_figure, profiles)),)
    better = [p.name for p in profiles if p.cost_increase.min() < -MIN_IMPROVEMENT]
    notes = tuple(
        f"{name}: a better fit was found on the profile: fit again from there" for name in better
    )
    return Chapter(
        "profiles", "Profile likelihood", summary, tables=tables, plots=plots, notes=notes
    )


def _profile_figure(profiles: Sequence[DynamicProfile]) -> Any:
    columns = min(3, len(profiles))
    rows = -(-len(profiles) // columns)
    figure, axes = new_figure(
        rows, columns, width=2.5 * columns + 0.6, height=2.4 * rows + 0.4, squeeze=False
    )
    for axis, profile in zip(axes.ravel(), profiles, strict=False):
        axis.plot(profile.values, profile.cost_increase, "o-", color=BLUE, markersize=3)
        axis.axhline(NORMAL_95**2, color=RED, linewidth=0.8, linestyle="--")
        axis.set_title(profile.name, fontsize=8)
        axis.set(
            xlabel="" if profile.unit == "1" else f"[{profile.unit}]",
            ylim=(-0.5, min(max(float(profile.cost_increase.max()), 6.0), 25.0)),
        )
        axis.locator_params(axis="x", nbins=4)
    for axis in axes[:, 0]:
        axis.set_ylabel("increase [variances]")
    for axis in axes.ravel()[len(profiles) :]:
        axis.set_visible(False)
    return figure


def _record(fit: DynamicFit, number: int) -> Chapter:
    course = fit.problem.record_models[number]
    origin = course.experiment.recording.origin
    measured = course.experiment.recording
    modelled = fit.modelled(number)
    errors = fit.residuals(number)
    columns: dict[str, Any] = {"time": TableColumn(course.times, "s")}
    for name, unit in zip(course.names, unit_column(course.names), strict=True):
        columns[f"measured {name}"] = TableColumn(measured[name], unit)
        columns[f"modelled {name}"] = TableColumn(modelled[name], unit)
        columns[f"residual of {name}"] = TableColumn(errors[name], unit)
    rms = ", ".join(f"{name} {displayed(name, fit.rms(name, number))}" for name in course.names)
    summary = (
        f"Rms residual: {rms}. The run begins at {course.start_time(fit.values):.4g} s of the"
        " record's time."
    )
    stem = f"record-{number + 1}"
    caption = f"{origin}: measured and modelled values, and residuals."
    table = Table(stem, "Measured and modelled values", columns, series=True)
    plot = Plot(stem, caption, partial(_record_figure, fit, number))
    title = f"Record {number + 1}: {origin}"
    return Chapter(stem, title, summary, tables=(table,), plots=(plot,), brief=False)


def _record_figure(fit: DynamicFit, number: int) -> Any:
    """Return a figure with measured and modelled values above the residuals, for every observed
    quantity.
    """
    course = fit.problem.record_models[number]
    modelled = fit.modelled(number)
    figure, axes = residual_panels(len(course.names))
    for name, panels in zip(course.names, axes.T, strict=True):
        factor, unit = display_scale(name)
        measured = factor * course.experiment.recording[name]
        draw_residuals(panels, course.times, measured, factor * modelled[name], "modelled")
        panels[0].set_ylabel(f"{name} [{unit}]")
        panels[1].set(xlabel="time [s]", ylabel=f"residual\n[{unit}]")
    legend_below(figure, axes[0, 0])
    return figure


def residual_panels(count: int, **options: Any) -> Any:
    """Return a figure and its axes (2, count): panels of values, and flat ones of residuals
    below.
    """
    size = {"width": 2.2 + 4.2 * count if count > 1 else 6.4, "height": 4.6}
    return new_figure(
        2, count, **{**size, "sharex": "col", **options}, squeeze=False, height_ratios=(2, 1)
    )


def draw_residuals(
    panels: Any, x: Array, measured: Array, modelled: Array, label: str, rows: Any = slice(None)
) -> None:
    """Draw the measured rows and the model over x in the first panel, and their difference in the
    second.
    """
    dots = {"linestyle": "none", "marker": ".", "markersize": 3, "color": BLUE}
    panels[0].plot(x[rows], measured[rows], label="measured", **dots)
    panels[0].plot(x, modelled, color=RED, linewidth=1.0, label=label)
    panels[1].plot(x[rows], (modelled - measured)[rows], **dots)
    panels[1].axhline(0.0, color=BLACK, linewidth=0.8)


def running_extreme(values: Array, extreme: np.ufunc, width: int = 9) -> Array:
    """Return the running minimum or maximum over `width` rows (chosen), the envelope of a band with
    two branches.
    """
    padded = np.pad(values, width // 2, mode="edge")
    return np.asarray(extreme.reduce([padded[i : i + values.size] for i in range(width)]))
