"""The chapters of a report on a dynamic fit: what was found, what stays open, and every record beside its model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from ..core.reference import cite
from ..recording.display_units import display_scale
from ..recording.recording import column_heading
from .chapter import Chapter, Plot, Table
from .uncertainty_chapter import NORMAL

if TYPE_CHECKING:
    from ..identify.dynamic import DynamicFit
    from ..identify.dynamic.profile import DynamicProfile


def dynamic_chapters(
    fit: DynamicFit, title: str, profiles: Sequence[DynamicProfile] = (), remarks: Sequence[str] = ()
) -> list[Chapter]:
    """Estimates with what is not determined, profiles, and one chapter a record; `remarks` are on the records."""
    found = [_estimates(fit, title, remarks)]
    if profiles:
        found.append(_profiles(profiles))
    return [*found, *(_record(fit, i) for i in range(len(fit.problem.record_models)))]


def _estimates(fit: DynamicFit, title: str, remarks: Sequence[str]) -> Chapter:
    known = fit.identifiability
    said = [
        f"Residuals of {fit.residual_std:.3g} standard deviations of the sensors; {known.rank} of {known.singular_values.size} "
        f"unknowns off their bounds are determined; {fit.starts_at_optimum} of {fit.costs.size} starts came to this optimum.",
        *(f"{note[:1].upper()}{note[1:].rstrip('.')}." for note in fit.notes),
        *remarks,
    ]
    rms = {
        "record": [c.experiment.recording.origin for c in fit.problem.record_models for _ in c.names],
        "quantity": [name for c in fit.problem.record_models for name in c.names],
        "rms error": [_in_words(fit.rms(n, i), n) for i, c in enumerate(fit.problem.record_models) for n in c.names],
    }
    tables = [_numbers(fit), *_open(fit), Table("rms", "Errors by record", rms), _correlations(fit)]
    return Chapter(
        paper="dynamic",
        title=title,
        summary="\n\n".join(said),
        tables=tuple(tables),
        references=tuple(cite(fit.plant())),
    )


def _in_words(value: float, name: str) -> str:
    factor, unit = display_scale(name)
    return f"{value * factor:.4g} {unit}"


def _numbers(fit: DynamicFit) -> Table:
    return Table(
        "estimates",
        "What was found",
        {
            "parameter": [e.name for e in fit.estimates],
            "symbol": [e.label for e in fit.estimates],
            "value (SI)": [e.value for e in fit.estimates],
            "2 sd (SI)": ["on bound" if e.on_bound else 2 * e.stderr for e in fit.estimates],
            "unit": ["" if e.unit == "1" else e.unit for e in fit.estimates],
            "meaning": [e.meaning for e in fit.estimates],
        },
    )


def _open(fit: DynamicFit) -> list[Table]:
    """Combinations that the records do not determine, and what would tell them apart."""
    found = fit.identifiability.undetermined
    if not found:
        return []
    columns: dict[str, Any] = {
        "these move together": [", ".join(f"{name} {share:+.2g}" for name, share in each.shares) for each in found],
        "standard deviation, of their size": [each.relative_stderr for each in found],
        "what would tell them apart": [each.remedy for each in found],
    }
    return [Table("not-determined", "What the records do not determine", columns)]


def _correlations(fit: DynamicFit) -> Table:
    names = [e.name for e in fit.estimates]
    columns = {name: fit.correlations[:, i] for i, name in enumerate(names)}
    return Table("correlations", "Correlations", {"unknown": names, **columns}, shown=False)


def _profiles(profiles: Sequence[DynamicProfile]) -> Chapter:
    ends = [profile.interval for profile in profiles]
    columns: dict[str, Any] = {
        "parameter": [p.name for p in profiles],
        "2.5 % (SI)": [low if np.isfinite(low) else "open" for low, _ in ends],
        "97.5 % (SI)": [high if np.isfinite(high) else "open" for _, high in ends],
        "unit": ["" if p.unit == "1" else p.unit for p in profiles],
    }
    return Chapter(
        paper="profiles",
        title="Profiles",
        summary="One number held at other values, all others found anew. An end is open where the sum of squares does "
        "not grow enough within the values that were tried: the records do not bound the number there.",
        tables=(Table("profiles", "95 % intervals", columns),),
        plots=(Plot("profiles", "Growth of the sum of squares; 95 % lies under the line.", _curves(profiles)),),
    )


def _curves(profiles: Sequence[DynamicProfile]) -> Any:
    columns = min(3, len(profiles))
    rows = -(-len(profiles) // columns)
    figure, axes = new_figure(rows, columns, width=2.5 * columns + 0.6, height=2.4 * rows + 0.4, squeeze=False)
    for axis, profile in zip(axes.ravel(), profiles, strict=False):
        axis.plot(profile.values, profile.cost_increase, "o-", color=BLUE, markersize=3)
        axis.axhline(NORMAL**2, color=RED, linewidth=0.8, linestyle="--")
        axis.set_title(profile.name, fontsize=8)
        axis.set(xlabel=f"[{profile.unit}]", ylim=(-0.5, min(max(float(profile.cost_increase.max()), 6.0), 25.0)))
        axis.locator_params(axis="x", nbins=4)
    for axis in axes[:, 0]:
        axis.set_ylabel("growth [variances]")
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
        columns[f"error of {column_heading(name)}"] = errors[name]
    rms = ", ".join(f"{name} {_in_words(fit.rms(name, number), name)}" for name in course.names)
    stem = f"record-{number + 1}"
    return Chapter(
        paper=stem,
        title=f"Record {number + 1}: {origin}",
        summary=f"Rms error: {rms}. The run begins at {course.start_time(fit.values):.4g} s of the record's clock.",
        tables=(Table(stem, "Measured and modelled", columns, shown=False),),
        plots=(Plot(stem, f"{origin}: measured, modelled, and what is left.", _course(fit, number)),),
    )


def _course(fit: DynamicFit, number: int) -> Any:
    """For every observed quantity an axis with both, and one with the residuals."""
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
        lower.set(xlabel="time [s]", ylabel=f"model less measured\n[{unit}]")
    legend_below(figure, axes[0, 0])
    return figure
