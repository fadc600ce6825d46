"""Report chapters: a dynamic fit with estimates, identifiability, profiles, and measured and modelled records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from ....core.reference import cite
from ....recording.display_units import display_scale, displayed
from ....recording.recording import column_heading
from ....report.chapter import Chapter, Plot, Table
from ..uncertainty_chapter import NORMAL_QUANTILE, UNBOUNDED
from . import CrossPrediction, DynamicFit, describe_cross_predictions
from .problem import DynamicProfile

MAX_OPTIMA = 8
"""Maximum number of optima in a table; the lowest are shown."""


def dynamic_chapters(
    fit: DynamicFit,
    title: str,
    profiles: Sequence[DynamicProfile] = (),
    remarks: Sequence[str] = (),
    cross: Sequence[CrossPrediction] = (),
) -> list[Chapter]:
    """Return the chapters of a dynamic fit: estimates and identifiability, profiles, and one chapter per record.

    `remarks` are sentences about the records, `cross` the predictions of each record by the others, which stand first.
    """
    chapters = [_estimates(fit, title, remarks, cross)]
    if profiles:
        chapters.append(_profiles(profiles))
    return [*chapters, *(_record(fit, i) for i in range(len(fit.problem.record_models)))]


def _estimates(fit: DynamicFit, title: str, remarks: Sequence[str], cross: Sequence[CrossPrediction]) -> Chapter:
    identifiability = fit.identifiability
    sentences = [
        *([describe_cross_predictions(cross)] if cross else []),
        f"Standard deviation of the residuals: {fit.residual_std:.3g} sensor standard deviations. Identifiable: "
        f"{identifiability.rank} of {identifiability.singular_values.size} unknowns that are not on a bound. "
        f"{fit.starts_at_optimum} of {fit.costs.size} initial points converged to this optimum.",
        *(f"{note[:1].upper()}{note[1:].rstrip('.')}." for note in fit.notes),
        *remarks,
    ]
    rms = {
        "record": [c.experiment.recording.origin for c in fit.problem.record_models for _ in c.names],
        "quantity": [name for c in fit.problem.record_models for name in c.names],
        "rms residual": [displayed(n, fit.rms(n, i)) for i, c in enumerate(fit.problem.record_models) for n in c.names],
    }
    tables = [
        *_cross_table(cross),
        _estimate_table(fit),
        *_undetermined_table(fit),
        *_optima_table(fit),
        Table("rms", "Residuals by record", rms),
        _correlations(fit),
    ]
    return Chapter(
        paper="dynamic",
        title=title,
        summary="\n\n".join(sentences),
        tables=tuple(tables),
        references=tuple(cite(fit.plant())),
    )


def _cross_table(cross: Sequence[CrossPrediction]) -> list[Table]:
    if not cross:
        return []
    pairs = [(each, name) for each in cross for name in each.rms]
    columns: dict[str, Any] = {
        "record": [each.record for each, _ in pairs],
        "quantity": [name for _, name in pairs],
        "rms error, predicted by the others": [displayed(name, each.rms[name]) for each, name in pairs],
        "rms residual of the joint fit": [displayed(name, each.fitted[name]) for each, name in pairs],
    }
    return [Table("cross", "Each record predicted by the parameters of the others", columns)]


def _estimate_table(fit: DynamicFit) -> Table:
    return Table(
        "estimates",
        "Estimates",
        {
            "parameter": [e.name for e in fit.estimates],
            "symbol": [e.label for e in fit.estimates],
            "value (SI)": [e.value for e in fit.estimates],
            "2 standard errors (SI)": ["on bound" if e.on_bound else 2 * e.stderr for e in fit.estimates],
            "unit": ["" if e.unit == "1" else e.unit for e in fit.estimates],
            "meaning": [e.meaning for e in fit.estimates],
        },
    )


def _undetermined_table(fit: DynamicFit) -> list[Table]:
    """Return a table of the combinations that the records do not determine, with the experiment that would."""
    undetermined = fit.identifiability.undetermined
    if not undetermined:
        return []
    columns: dict[str, Any] = {
        "combination (relative changes)": [
            ", ".join(f"{name} {share:+.2g}" for name, share in each.shares) for each in undetermined
        ],
        "relative standard deviation": [each.relative_stderr for each in undetermined],
        "experiment that determines it": [each.remedy for each in undetermined],
    }
    return [Table("not-determined", "Parameter combinations that the records do not determine", columns)]


def _optima_table(fit: DynamicFit) -> list[Table]:
    """Return a table of the optima of the searches with their estimates, if there are several."""
    if len(fit.optima) < 2:
        return []
    shown = fit.optima[:MAX_OPTIMA]
    columns: dict[str, Any] = {
        "searches": [each.searches for each in shown],
        "rms residual relative to the lowest": [
            float(np.sqrt(each.cost / max(fit.optima[0].cost, 1e-300))) for each in shown
        ],
    }
    for i, estimate in enumerate(fit.estimates):
        unit = f" [{estimate.display_unit}]" if estimate.display_unit else ""
        columns[f"{estimate.name}{unit}"] = [float(each.values[i]) for each in shown]
    return [Table("optima", "Optima of the searches", columns)]


def _correlations(fit: DynamicFit) -> Table:
    names = [e.name for e in fit.estimates]
    columns = {name: fit.correlations[:, i] for i, name in enumerate(names)}
    return Table("correlations", "Correlations", {"unknown": names, **columns}, shown=False)


_PROFILE_CAPTION = "Increase of the sum of squares; dashed: limit of the 95 % interval."


def _profiles(profiles: Sequence[DynamicProfile]) -> Chapter:
    ends = [profile.interval for profile in profiles]
    columns: dict[str, Any] = {
        "parameter": [p.name for p in profiles],
        "2.5 % (SI)": [low if np.isfinite(low) else UNBOUNDED for low, _ in ends],
        "97.5 % (SI)": [high if np.isfinite(high) else UNBOUNDED for _, high in ends],
        "unit": ["" if p.unit == "1" else p.unit for p in profiles],
    }
    return Chapter(
        paper="profiles",
        title="Profile likelihood",
        summary="One parameter is fixed at a series of values and all others are estimated again. An end is unbounded "
        "if the sum of squares does not rise enough within these values: the records do not limit the parameter there.",
        tables=(Table("profiles", "95 % intervals", columns),),
        plots=(Plot("profiles", _PROFILE_CAPTION, _profile_figure(profiles)),),
    )


def _profile_figure(profiles: Sequence[DynamicProfile]) -> Any:
    columns = min(3, len(profiles))
    rows = -(-len(profiles) // columns)
    figure, axes = new_figure(rows, columns, width=2.5 * columns + 0.6, height=2.4 * rows + 0.4, squeeze=False)
    for axis, profile in zip(axes.ravel(), profiles, strict=False):
        axis.plot(profile.values, profile.cost_increase, "o-", color=BLUE, markersize=3)
        axis.axhline(NORMAL_QUANTILE**2, color=RED, linewidth=0.8, linestyle="--")
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
    measured, modelled, errors = course.experiment.recording, fit.modelled(number), fit.residuals(number)
    columns: dict[str, Any] = {"time [s]": course.times}
    for name in course.names:
        columns[f"measured {column_heading(name)}"] = measured[name]
        columns[f"modelled {column_heading(name)}"] = modelled[name]
        columns[f"residual of {column_heading(name)}"] = errors[name]
    rms = ", ".join(f"{name} {displayed(name, fit.rms(name, number))}" for name in course.names)
    stem = f"record-{number + 1}"
    return Chapter(
        paper=stem,
        title=f"Record {number + 1}: {origin}",
        summary=f"Rms residual: {rms}. The run begins at {course.start_time(fit.values):.4g} s of the record's time.",
        tables=(Table(stem, "Measured and modelled values", columns, shown=False),),
        plots=(Plot(stem, f"{origin}: measured and modelled values, and residuals.", _record_figure(fit, number)),),
    )


def _record_figure(fit: DynamicFit, number: int) -> Any:
    """Return a figure with measured and modelled values above the residuals, for every observed quantity."""
    course = fit.problem.record_models[number]
    modelled, errors = fit.modelled(number), fit.residuals(number)
    count = len(course.names)
    figure, axes = new_figure(
        2, count, width=2.2 + 4.2 * count if count > 1 else 6.4, height=4.6, sharex=True, squeeze=False,
        height_ratios=(2, 1),
    )  # fmt: skip
    for i, name in enumerate(course.names):
        (factor, unit), (upper, lower) = display_scale(name), axes[:, i]
        dots = {"linestyle": "none", "marker": ".", "markersize": 3}
        upper.plot(course.times, factor * course.experiment.recording[name], color=BLUE, label="measured", **dots)
        upper.plot(course.times, factor * modelled[name], color=RED, label="modelled")
        lower.plot(course.times, factor * errors[name], color=BLUE, **dots)
        lower.axhline(0.0, color=BLACK, linewidth=0.8)
        upper.set_ylabel(f"{name} [{unit}]")
        lower.set(xlabel="time [s]", ylabel=f"residual\n[{unit}]")
    legend_below(figure, axes[0, 0])
    return figure
