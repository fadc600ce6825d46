"""Selection of a law for one purpose or for two, and the report chapter of a comparison by
cross-validation.
"""

import dataclasses
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...core import BLUE, LINES, MARKERS, IdentificationError, ShortRepr, legend_outside, new_figure
from ...engine.processes import Workers
from ...recording import Recording
from ...recording.columns import display_scale
from ...report.chapter import Chapter, Plot, Table, TableColumn
from ...report.formatting import to_mathtext
from ...report.formulas import symbol_formula
from ..diagnosis import DataUse, support_of
from ..estimation import (
    GroupSplit,
    LeastSquares,
    Loss,
    RunSplit,
    SpecimenSplit,
    in_order,
    specimen_name,
)
from ..statics import MIN_POOLED, Candidate, Fit
from .candidate_scores import RankedModel
from .model_selection import (
    Comparison,
    compare,
    compare_splits,
    eligible_models,
    excess_error,
    is_contradicted,
    recommendation,
)

SPLITS = (RunSplit(), SpecimenSplit())
"""The splits of the two purposes."""
MAX_JOINT_EXCESS = 0.05
"""Maximum excess of the error of a simpler law over the lowest one, for each purpose (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LawSelection(ShortRepr):
    """The law that is recommended for one purpose, or for both; `print` it."""

    comparisons: tuple[Comparison, ...]
    """One for each purpose."""
    recommended: tuple[RankedModel, ...]
    """The law in the ranking of each comparison."""
    reason: str

    def __str__(self) -> str:
        return self.reason


def select_for_both(
    recordings: Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    loss: Loss = LeastSquares(),
    workers: Workers = 1,
    progress: Callable[[str, float], None] | None = None,
) -> LawSelection:
    """One law for further runs (leave-one-run-out) and for other muscles (leave-one-specimen-out
    cross-validation).

    The arguments are those of `compare`. Laws that pull where a muscle was measured slack are not
    eligible. The best law has the smallest maximum, over the purposes, of the ratio of its error to
    the lowest one. Of the candidates that are worse for neither purpose by more than one standard
    error of the difference, and by at most 5 % than the best law of each purpose, the one with the
    fewest parameters is recommended. Raises IdentificationError where no candidate is determined
    for both purposes.
    """
    support_of(recordings).check(DataUse.COMPARISON)
    comparisons = compare_splits(
        recordings, candidates, SPLITS, loss=loss, workers=workers, progress=progress
    )
    rankings = [
        {model.candidate.name: model for model in eligible_models(comparison.ranking)}
        for comparison in comparisons
    ]
    names = [name for name in rankings[0] if all(name in ranking for ranking in rankings)]
    if not names:
        raise IdentificationError(
            "no candidate is determined without each run and without each specimen. Measure at more"
            " levels of pressure and contraction, or give candidates with fewer parameters."
        )

    lowest = [min(model.cross_validated_rmse for model in ranking.values()) for ranking in rankings]

    def ratios(name: str) -> tuple[float, ...]:
        return tuple(
            r[name].cross_validated_rmse / error for r, error in zip(rankings, lowest, strict=True)
        )

    best = in_order(
        list(names), lambda name: max(ratios(name)), lambda name: rankings[0][name].parameter_count
    )[0]
    limit = max(1 + MAX_JOINT_EXCESS, *ratios(best))
    within = [name for name in names if max(ratios(name)) <= limit]
    for ranking in (
        rankings
    ):  # not worse by more than one standard error, nor contradicted by the rows of the fit
        not_worse = [name for name in within if excess_error(ranking[name], ranking[best]) <= 0]
        within = [name for name in not_worse if not is_contradicted(ranking[name], ranking[best])]
    chosen = min(within, key=lambda name: (rankings[0][name].parameter_count, max(ratios(name))))
    models = tuple(ranking[chosen] for ranking in rankings)
    opening = recommendation("all purposes", models[0], list(rankings[0].values()))
    lines = [f"{opening}: {chosen}, one law with {models[0].parameter_count} parameters."]
    for comparison, model, ratio in zip(comparisons, models, ratios(chosen), strict=True):
        lowest_of = eligible_models(comparison.ranking)[0]
        lines.append(
            f"For {comparison.purpose}: rms error {model.cross_validated_rmse:.4g} N,"
            f" {100 * (ratio - 1):.2g} % above the lowest, {lowest_of.cross_validated_rmse:.4g} N"
            f" of {lowest_of.candidate.name}."
        )
    return LawSelection(comparisons, models, "\n".join(lines + _misfit(models[0])))


def _misfit(model: RankedModel) -> list[str]:
    """The misfit of a law with its causes, as a line; empty without one."""
    return [] if model.fit.misfit is None else [str(model.fit.misfit)]


def select_law(
    recordings: Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    both: bool | None = None,
    loss: Loss = LeastSquares(),
    workers: Workers = 1,
    progress: Callable[[str, float], None] | None = None,
) -> LawSelection:
    """The law for the purpose of a split, or one law for further runs and for other muscles.

    leave_out   the split of a single purpose, as in `compare`
    both        whether one law must serve both purposes; by default if no split is given and the
                recordings contain three specimens or more, each in several runs

    The other arguments are those of `compare`. Raises IdentificationError where no candidate is
    determined.
    """
    counts = Counter(specimen_name(run) for run in recordings)
    serves_both = len(counts) >= MIN_POOLED and min(counts.values()) > 1
    if both or (both is None and leave_out is None and serves_both):
        return select_for_both(
            recordings, candidates, loss=loss, workers=workers, progress=progress
        )
    comparison = compare(
        recordings, candidates, leave_out=leave_out, loss=loss, workers=workers, progress=progress
    )
    return LawSelection((comparison,), (comparison.recommended,), comparison.reason)


_MAX_LABELS = 24
"""Maximum number of parameters that are labelled in the figure of the correlations."""
_MAX_CURVES = 6


def compare_chapters(
    comparisons: Sequence[Comparison], recommended: RankedModel, reason: str
) -> list[Chapter]:
    """Return a chapter for each purpose; the figures of the fit of the recommended law are in the
    first.
    """
    return [
        compare_chapter(
            comparison, recommended, reason, figures_of_fit=comparison is comparisons[0]
        )
        for comparison in comparisons
    ]


def compare_chapter(
    comparison: Comparison,
    recommended: RankedModel | None = None,
    reason: str = "",
    *,
    figures_of_fit: bool = True,
) -> Chapter:
    """Return the chapter of a comparison: ranking, exclusions, errors by fold, figures of the
    recommended fit. `recommended` is the law that was selected for several purposes, for the given
    reason."""
    fit = (recommended or comparison.recommended).fit
    chapter = comparison.chapter()
    joint = () if reason in ("", comparison.reason) else (reason,)
    plots = [
        Plot(
            "left-out",
            "Cross-validation error of the laws on each fold.",
            partial(_fold_figure, comparison),
        )
    ]
    if figures_of_fit:
        text = "Correlations of the parameters of the recommended law."
        plots += [
            Plot(
                "residuals",
                "Residuals of the recommended law over each variable.",
                partial(residual_figure, fit),
            ),
            Plot("correlations", text, partial(correlation_figure, fit)),
        ]
    parts = dict.fromkeys(part.fold for model in comparison.ranking for part in model.fold_scores)
    columns: dict[str, Any] = {"fold": list(parts)}
    for model in comparison.ranking:
        errors = {part.fold: part.rmse for part in model.fold_scores}
        columns[model.candidate.name] = TableColumn([errors.get(part) for part in parts], "N")
    chapter = replace(
        chapter,
        summary=(*joint, *chapter.paragraphs),
        tables=(*chapter.tables, Table("left-out-parts", "Errors by fold", columns, shown=False)),
        plots=tuple(plots),
    )
    group = comparison.leave_out.group_name
    return replace(chapter.among(f"{group}-"), name=f"comparison-{group}") if joint else chapter


def _fold_figure(comparison: Comparison) -> Any:
    def by_number(name: str) -> list[str | float]:  # contraction 3 % before contraction 12 %
        return [
            float(part) if i % 2 else part
            for i, part in enumerate(re.split(r"(\d+(?:\.\d+)?)", name))
        ]

    figure, axes = new_figure(width=7.0, height=3.6)
    folds = sorted((part.fold for part in comparison.ranking[0].fold_scores), key=by_number)
    for i, contender in enumerate(comparison.ranking[:_MAX_CURVES]):
        error_of = {part.fold: part.rmse for part in contender.fold_scores}
        errors = [error_of[fold] for fold in folds]
        axes.plot(
            errors,
            MARKERS[i],
            color=LINES[i],
            linestyle=":",
            linewidth=0.8,
            label=contender.candidate.name,
        )
    word = folds[0].partition(" ")[0] + " "  # that all names begin with, if they do
    common = word if all(name.startswith(word) for name in folds) else ""
    own = [name[len(common) :] for name in folds]
    axes.set_xticks(
        range(len(own)),
        [n if len(n) <= 22 else f"...{n[-20:]}" for n in own],
        rotation=30,
        ha="right",
    )
    axes.set(
        xlabel=common.strip(),
        ylabel=f"rms error, {comparison.leave_out.group_name} left out [N]",
        yscale="log",
    )
    legend_outside(axes)
    return figure


def residual_figure(fit: Fit) -> Any:
    """Return the figure of the residuals over pressure, contraction and force."""
    factor, unit = display_scale(fit.fitted_quantity.name)
    figure, panels = new_figure(1, 3, width=7.5, height=2.8, sharey=True)
    for axes, name in zip(panels, ("pressure", "contraction", "force"), strict=True):
        scale, axis_unit = display_scale(name)
        axes.plot(
            fit.recording[name] * scale,
            fit.residuals * factor,
            "o",
            color=BLUE,
            markersize=2.5,
            alpha=0.6,
        )
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
