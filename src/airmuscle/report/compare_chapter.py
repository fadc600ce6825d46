"""The chapter of a report that a comparison of laws fills."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plotting import BLUE, LINES, MARKERS, legend_outside, new_figure
from .chapter import Chapter, Plot, Table

if TYPE_CHECKING:
    from ..identify.model_selection import Comparison
    from ..identify.result import Fit

_SHOWN = {"pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "force": (1.0, "N")}
_MOST_NAMES = 24
"""Parameters whose names still fit beside the figure of their correlations."""
_CURVES = 6


def compare_chapter(found: Comparison) -> Chapter:
    """Ranking, exclusions, errors by part, and the figures of the recommended fit."""
    fit = found.recommended.fit
    return Chapter(
        paper="comparison",
        title="Which law to take",
        summary=f"{found.reason}\n\nLeft out in turn: each {found.leave_out.group_name}. All errors are in force, over the "
        "rows in which the muscle pulled.",
        tables=tuple(table for table in (_ranking(found), _excluded(found), _parts(found)) if table is not None),
        plots=(
            Plot("left-out", "Error on each part by laws that had not seen it.", _by_part(found)),
            Plot("residuals", "Errors of the recommended law against each variable.", residuals(fit)),
            Plot("correlations", "Correlations of its parameters.", correlations(fit)),
        ),
    )


def _ranking(found: Comparison) -> Table:
    contenders = found.ranking
    return Table(
        "ranking",
        "Laws by their error on what was left out",
        {
            "law": [c.candidate.name for c in contenders],
            "parameters": [c.parameter_count for c in contenders],
            "in sample [N]": [c.in_sample_rmse for c in contenders],
            "left out [N]": [c.cross_validated_rmse for c in contenders],
            "AICc": [c.aicc for c in contenders],
        },
    )


def _excluded(found: Comparison) -> Table | None:
    if not found.excluded:
        return None
    columns = {"law": [e.name for e in found.excluded], "why": [e.reason for e in found.excluded]}
    return Table("excluded", "Laws that these data do not determine", columns)


def _parts(found: Comparison) -> Table:
    parts = {part.fold: None for c in found.ranking for part in c.fold_scores}
    columns: dict[str, Any] = {"part": list(parts)}
    for contender in found.ranking:
        errors = {part.fold: part.rmse for part in contender.fold_scores}
        columns[f"{contender.candidate.name} [N]"] = [errors.get(part, float("nan")) for part in parts]
    return Table("left-out-parts", "Errors by part", columns, shown=False)


def _by_part(found: Comparison) -> Any:
    figure, axes = new_figure(width=7.0, height=3.6)
    for i, contender in enumerate(found.ranking[:_CURVES]):
        errors = [part.rmse for part in contender.fold_scores]
        axes.plot(errors, MARKERS[i], color=LINES[i], linestyle=":", linewidth=0.8, label=contender.candidate.name)
    names = [part.fold for part in found.ranking[0].fold_scores]
    axes.set_xticks(range(len(names)), [_short(name) for name in names], rotation=30, ha="right")
    axes.set(ylabel=f"rms error, {found.leave_out.group_name} left out [N]", yscale="log")
    legend_outside(axes)
    return figure


def _short(name: str) -> str:
    return name if len(name) <= 22 else f"...{name[-20:]}"


def residuals(fit: Fit) -> Any:
    """Model less measured against pressure, contraction and force."""
    factor, unit = _SHOWN[fit.fitted_quantity.name]
    figure, places = new_figure(1, 3, width=7.5, height=2.8, sharey=True)
    for axes, (name, (scale, word)) in zip(places, _SHOWN.items(), strict=True):
        axes.plot(fit.recording[name] * scale, fit.residuals * factor, "o", color=BLUE, markersize=2.5, alpha=0.6)
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set(xlabel=f"measured {name} [{word}]")
    places[0].set(ylabel=f"model less measured\n{fit.fitted_quantity.name} [{unit}]")
    return figure


def correlations(fit: Fit) -> Any:
    """The correlation matrix as a map from -1 to 1."""
    size = len(fit.estimates)
    figure, axes = new_figure(width=5.2, height=4.4)
    image = axes.imshow(np.asarray(fit.correlations), vmin=-1, vmax=1, cmap="RdBu_r")
    if size <= _MOST_NAMES:
        labels = [estimate.label for estimate in fit.estimates]
        axes.set_xticks(range(size), labels, rotation=90)
        axes.set_yticks(range(size), labels)
    axes.grid(False)
    figure.colorbar(image, ax=axes, label="correlation [1]")
    return figure
