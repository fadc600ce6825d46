"""Report chapter: a comparison of laws by cross-validation."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...core.plotting import BLUE, LINES, MARKERS, legend_outside, new_figure
from ...report.chapter import Chapter, Plot, Table, TableColumn
from ...report.formula import symbol_formula, to_mathtext
from . import Comparison, Fit
from .candidate_scores import RankedModel

_DISPLAY_UNITS = {"pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "force": (1.0, "N")}
_MAX_LABELS = 24
"""Maximum number of parameters that are labelled in the figure of the correlations."""
_MAX_CURVES = 6


def compare_chapters(comparisons: Sequence[Comparison], recommended: RankedModel, reason: str) -> list[Chapter]:
    """Return a chapter for each purpose; the figures of the fit of the recommended law are in the first."""
    return [compare_chapter(each, recommended, reason, figures_of_fit=each is comparisons[0]) for each in comparisons]


def compare_chapter(
    comparison: Comparison, recommended: RankedModel | None = None, reason: str = "", *, figures_of_fit: bool = True
) -> Chapter:
    """Return the chapter of a comparison: ranking, exclusions, errors by fold, figures of the recommended fit.

    `recommended` is the law that was selected for several purposes, for the given reason.
    """
    fit, chapter = (recommended or comparison.recommended).fit, comparison.chapter()
    joint = () if reason in ("", comparison.reason) else (reason,)
    folds = Plot("left-out", "Cross-validation error of the laws on each fold.", partial(_fold_figure, comparison))
    chapter = replace(
        chapter,
        summary=(*joint, *chapter.paragraphs),
        tables=(*chapter.tables, _fold_table(comparison)),
        plots=(folds, *(_plots_of_fit(fit) if figures_of_fit else ())),
    )
    group = comparison.leave_out.group_name
    return replace(chapter.among(f"{group}-"), name=f"comparison-{group}") if joint else chapter


def _plots_of_fit(fit: Fit) -> tuple[Plot, ...]:
    return (
        Plot("residuals", "Residuals of the recommended law over each variable.", partial(residual_figure, fit)),
        Plot(
            "correlations", "Correlations of the parameters of the recommended law.", partial(correlation_figure, fit)
        ),
    )


def _fold_table(comparison: Comparison) -> Table:
    parts = {part.fold: None for c in comparison.ranking for part in c.fold_scores}
    columns: dict[str, Any] = {"fold": list(parts)}
    for contender in comparison.ranking:
        errors = {part.fold: part.rmse for part in contender.fold_scores}
        columns[contender.candidate.name] = TableColumn([errors.get(part) for part in parts], "N")
    return Table("left-out-parts", "Errors by fold", columns, shown=False)


def _fold_figure(comparison: Comparison) -> Any:
    figure, axes = new_figure(width=7.0, height=3.6)
    folds = sorted((part.fold for part in comparison.ranking[0].fold_scores), key=_natural_order)
    for i, contender in enumerate(comparison.ranking[:_MAX_CURVES]):
        error_of = {part.fold: part.rmse for part in contender.fold_scores}
        errors = [error_of[fold] for fold in folds]
        axes.plot(errors, MARKERS[i], color=LINES[i], linestyle=":", linewidth=0.8, label=contender.candidate.name)
    common = _common_word(folds)
    axes.set_xticks(range(len(folds)), [_shorten(name[len(common) :]) for name in folds], rotation=30, ha="right")
    axes.set(xlabel=common.strip(), ylabel=f"rms error, {comparison.leave_out.group_name} left out [N]", yscale="log")
    legend_outside(axes)
    return figure


def _natural_order(name: str) -> list[str | float]:
    """A key that sorts names by the numbers in them: contraction 3 % before contraction 12 %."""
    parts = re.split(r"(\d+(?:\.\d+)?)", name)
    return [float(part) if i % 2 else part for i, part in enumerate(parts)]


def _common_word(names: Sequence[str]) -> str:
    """The first word of the names with the blank behind it, if all have the same; otherwise an empty text."""
    word = names[0].partition(" ")[0] + " "
    return word if all(name.startswith(word) for name in names) else ""


def _shorten(name: str) -> str:
    return name if len(name) <= 22 else f"...{name[-20:]}"


def residual_figure(fit: Fit) -> Any:
    """Return the figure of the residuals over pressure, contraction and force."""
    factor, unit = _DISPLAY_UNITS[fit.fitted_quantity.name]
    figure, panels = new_figure(1, 3, width=7.5, height=2.8, sharey=True)
    for axes, (name, (scale, axis_unit)) in zip(panels, _DISPLAY_UNITS.items(), strict=True):
        axes.plot(fit.recording[name] * scale, fit.residuals * factor, "o", color=BLUE, markersize=2.5, alpha=0.6)
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set(xlabel=f"measured {name} [{axis_unit}]")
    panels[0].set(ylabel=f"residual of\n{fit.fitted_quantity.name} [{unit}]")
    return figure


def correlation_figure(fit: Fit) -> Any:
    """Return the figure of the correlation matrix, on a colour scale from -1 to 1."""
    size = len(fit.estimates)
    figure, axes = new_figure(width=5.2, height=4.4)
    image = axes.imshow(np.asarray(fit.correlations), vmin=-1, vmax=1, cmap="RdBu_r")
    if size <= _MAX_LABELS:
        labels = [to_mathtext(symbol_formula(estimate.label)) for estimate in fit.estimates]
        axes.set_xticks(range(size), labels, rotation=90)
        axes.set_yticks(range(size), labels)
    else:
        axes.set(xlabel="number of the parameter", ylabel="number of the parameter")
    axes.grid(False)
    figure.colorbar(image, ax=axes, label="correlation")
    return figure
