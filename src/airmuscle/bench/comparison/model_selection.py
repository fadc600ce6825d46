"""Model selection by cross-validation: ranking, eligible laws, one-standard-error rule, evidence
for few folds.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core import HintedText, IdentificationError, check_known
from ...engine.processes import Workers
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Table, TableColumn
from ..diagnosis import DataUse, support_of
from ..estimation import (
    TIE,
    GroupSplit,
    LeastSquares,
    Loss,
    aicc,
    default_split,
    in_order,
    tied_groups,
)
from ..reported import Reported
from ..statics import (
    Candidate,
    ExcludedModel,
    FitPoints,
    find_length_errors,
    length_notes,
    started_candidates,
)
from .candidate_scores import MAX_RECOMMENDED_EXCESS, RankedModel, score_candidates
from .compared_points import ComparedPoints

MIN_FOLDS = 6
"""Number of folds from which the standard error of their differences decides alone (chosen): the
relative standard error of a standard deviation of k normal values is 1/sqrt(2(k - 1)), 50 % for
three folds and 32 % for six."""
MAX_AICC_EXCESS = 10.0
"""Excess of AICc above which a model has essentially no support (Burnham and Anderson, Model
Selection and Multimodel Inference (2002), section 2.6)."""


def eligible_models(ranking: Sequence[RankedModel]) -> list[RankedModel]:
    """The models that do not pull where a muscle was measured slack, in their order, and those that
    pull no more there than any of them does: the limit of a law grows with its error, which must
    not favour a worse law. All models where each pulls."""
    least = min(
        (model.slack.greatest for model in ranking if not model.slack.pulling), default=np.inf
    )
    return [model for model in ranking if not model.slack.pulling or model.slack.greatest <= least]


def recommend(ranking: Sequence[RankedModel], split: GroupSplit) -> tuple[RankedModel, str]:
    """The model by the one-standard-error rule within the maximum excess, and the reason as a
    sentence with numbers.

    ranking  models with the folds of one split, lowest cross-validated error first
    """
    eligible = eligible_models(ranking)
    best = eligible[0]
    limit = (1 + MAX_RECOMMENDED_EXCESS) * best.cross_validated_rmse
    equivalent = [
        m for m in eligible if m.cross_validated_rmse <= limit and excess_error(m, best) <= 0
    ]
    recommended = simplest([m for m in equivalent if not is_contradicted(m, best)])
    text = (
        f"{recommendation(split.purpose, recommended, eligible)}: {recommended.candidate.name} with"
        f" {recommended.parameter_count} parameters, rms error"
        f" {recommended.cross_validated_rmse:.4g} N in leave-one-{split.group_name}-out"
        " cross-validation"
    )
    if recommended is best:
        text += (
            ", the lowest of all."
            if best is ranking[0]
            else ", the lowest of the laws that may be recommended."
        )
    else:
        text += (
            f". The error of {best.candidate.name} with {best.parameter_count} parameters,"
            f" {best.cross_validated_rmse:.4g} N, is not lower by more than one standard error of"
            " the difference."
        )
    simpler = simplest(equivalent)
    if simpler is not recommended:  # the rows of the fit contradict it
        text += (
            f" {simpler.candidate.name} with {simpler.parameter_count} parameters is within one"
            f" standard error, which is poorly estimated from {len(best.fold_scores)} folds, but"
            f" its error on the rows of the fit, {simpler.in_sample_rmse:.4g} N, exceeds"
            f" {best.in_sample_rmse:.4g} N by more than the noise explains."
        )
    misfit = recommended.fit.misfit
    stated = "" if misfit is None else f" {misfit}"
    return recommended, text + _pulling(ranking, recommended) + stated


def recommendation(purpose: str, recommended: RankedModel, eligible: Sequence[RankedModel]) -> str:
    """The words before a recommended law for a purpose, which are conditional where the law does
    not follow the data.
    """
    if recommended.fit.misfit is None:
        return f"Recommended for {purpose}"
    names = (
        model.candidate.name
        for model in eligible
        if model.fit.scatter is not None and model.fit.misfit is None
    )
    follows = next(names, "")
    missed = f"it does not follow the data as {follows} does" if follows else NONE_FOLLOWS
    return f"Best of those compared for {purpose}, but {missed}"


def simplest(ranking: Sequence[RankedModel]) -> RankedModel:
    """The first of the models with the fewest parameters."""
    return min(ranking, key=lambda model: model.parameter_count)


def _pulling(ranking: Sequence[RankedModel], recommended: RankedModel) -> str:
    """The sentence on laws with a lower error that pull where a muscle is slack; empty without
    them.
    """
    if recommended.slack.pulling:
        return (
            " No law pulls less where a muscle was measured slack; of this one,"
            f" {recommended.slack}."
        )
    eligible = eligible_models(ranking)
    better = [
        m
        for m in ranking
        if m not in eligible and m.cross_validated_rmse < recommended.cross_validated_rmse
    ]
    if not better:
        return ""
    more = f" and {len(better) - 1} more" if len(better) > 1 else ""
    return (
        f" Not recommended, although its error is lower: {better[0].candidate.name}{more}, because "
        f"{better[0].slack}, more than {better[0].slack.limit:.3g} N."
    )


def is_contradicted(model: RankedModel, best: RankedModel) -> bool:
    """Whether there are few folds and AICc on the rows of the fit gives a law no support against
    the best one. The rows count with their effective number, because their residuals are
    correlated."""
    if len(best.fold_scores) >= MIN_FOLDS:
        return False
    criterion, criterion_of_best = (
        aicc(law.in_sample_rmse**2, best.effective_rows, law.parameter_count)
        for law in (model, best)
    )
    return bool(np.isfinite(criterion_of_best) and criterion - criterion_of_best > MAX_AICC_EXCESS)


def excess_error(model: RankedModel, best: RankedModel) -> float:
    """Difference of the mean square errors [N^2], minus one standard error of it over the folds."""
    folds = zip(model.fold_scores, best.fold_scores, strict=True)
    difference = np.array([score.rmse**2 - of_best.rmse**2 for score, of_best in folds])
    rows = np.array([score.rows for score in best.fold_scores], dtype=float)
    mean = float(np.average(difference, weights=rows))
    variance = np.average((difference - mean) ** 2, weights=rows)
    spread = float(np.sqrt(variance / max(difference.size - 1, 1)))
    excess = mean - spread
    return excess if abs(excess) > TIE * best.cross_validated_rmse**2 else 0.0


MAX_LIMITED = 0.01
"""Fraction of the rows above which limited residuals are no outliers (chosen)."""
RANKED_ON_PAGE = 6
"""Laws of the ranking that a page shows before the others are unfolded (chosen)."""
MAX_LISTED = 10
SHORT_LISTED = 4
"""Maximum numbers of ranked laws, besides the recommended one, and of excluded laws in the brief
view (chosen).
"""
NONE_FOLLOWS = "none follows the data"
_SLACK_NOTE = (
    "Slack rows: where the muscle was measured slack. A law that pulls there more than three rms"
    " errors of the law and 2 % of the maximum force is not recommended if another law pulls less."
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Comparison(Reported):
    """The ranked models, lowest cross-validated error first, and the excluded candidates; `print`
    it.
    """

    ranking: tuple[RankedModel, ...]
    excluded: tuple[ExcludedModel, ...]
    leave_out: GroupSplit
    recommended: RankedModel
    reason: str
    unavailable: tuple[ExcludedModel, ...] = ()
    """Standard candidates whose initial values do not follow from the data; empty if candidates
    were given.
    """
    notes: tuple[str, ...] = ()
    """Remarks on the data and on the fit of the recommended law, such as contradicting rows or two
    branches.
    """

    @property
    def purpose(self) -> str:
        """The use for which the recommended law is best; it follows from the groups that were left
        out.
        """
        return self.leave_out.purpose

    def __getitem__(self, name: str) -> RankedModel:
        """A ranked model by its name. Raises IdentificationError."""
        models = {model.candidate.name: model for model in self.ranking}
        check_known("the comparison has no model", name, models, "it has", IdentificationError)
        return models[name]

    def chapter(self) -> Chapter:
        """The description of the comparison: recommendation, ranking, excluded laws, remarks on the
        data.
        """
        names: dict[str, list[str]] = {}
        for law in self.unavailable:
            names.setdefault(law.cause, []).append(law.name)
        excluded = _unranked("excluded", "Laws that are not ranked", self.excluded, SHORT_LISTED)
        unavailable = _unranked("not-compared", "Laws that are not compared", self.unavailable, 0)
        return Chapter(
            name="comparison",
            title=(
                f"Leave-one-{self.leave_out.group_name}-out cross-validation; the ranking is for"
                f" {self.purpose}"
            ),
            summary=(
                self.reason,
                (
                    f"Cross-validation: each {self.leave_out.group_name} is left out in turn. All"
                    " errors are errors of the force, over the rows with a positive force; the"
                    " squared force of the law at slack rows is added."
                ),
            ),
            values=(
                NamedValue("recommended", self.recommended.candidate.name, brief=False),
                NamedValue("left out", self.leave_out.group_name, brief=False),
                NamedValue("purpose", self.purpose, brief=False),
            ),
            tables=(
                self._ranking_table(),
                *(table for table in (excluded, unavailable) if len(table)),
            ),
            notes=(
                *(note for note in self.notes if note not in self.reason),
                *(f"{m.candidate.name}: {note}" for m in self.ranking for note in m.notes),
                *(f"not compared: {', '.join(laws)}: {cause}." for cause, laws in names.items()),
            ),
        )

    def _ranking_table(self) -> Table:
        models = self.ranking
        lowest = min(m.aicc for m in self.ranking)
        columns: dict[str, Any] = {
            "law": [m.candidate.name for m in models],
            "parameters": [m.parameter_count for m in models],
            "in-sample rms error": TableColumn(
                [m.in_sample_rmse for m in models], "N", short="in sample"
            ),
            "cross-validation rms error": TableColumn(
                [m.cross_validated_rmse for m in models], "N", short="left out"
            ),
            "AICc above the lowest": TableColumn(
                [m.aicc - lowest for m in models], short="AICc excess"
            ),
        }
        if any(m.slack.rows for m in models):
            columns["maximum force at slack rows"] = TableColumn(
                [m.slack.greatest for m in models], "N", digits=3, short="at slack"
            )
        if any(m.slack.pulling for m in models):
            pulls = [bool(m.slack.pulling) for m in models]
            columns["pulls at slack rows"] = TableColumn(pulls, short="pulls at slack")
        recommended = next(i for i, m in enumerate(models) if m is self.recommended)
        rows = sorted({*range(min(MAX_LISTED, len(models))), recommended})
        return Table(
            "ranking",
            "Ranking by cross-validation error",
            columns,
            _SLACK_NOTE,
            brief=rows,
            head=RANKED_ON_PAGE,
        )


def _unranked(name: str, title: str, models: Sequence[ExcludedModel], brief: int) -> Table:
    too_large = "its error, {:.4g} N, is too large; its cross-validation was not completed"
    columns: dict[str, Any] = {
        "law": [model.name for model in models],
        "cause": [
            model.cause if model.error is None else too_large.format(model.error)
            for model in models
        ],
        "error": TableColumn([model.error for model in models], "N", brief=False),
        "reason": TableColumn([model.reason for model in models], brief=False),
    }
    return Table(name, title, columns, brief=brief)


def compare(
    recordings: Recording | Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    loss: Loss = LeastSquares(),
    workers: Workers = 1,
    progress: Callable[[str, float], None] | None = None,
) -> Comparison:
    """Fit all candidates, rank them by their cross-validated error in force, and recommend one.

    candidates  by default `standard_candidates`, the laws whose initial values follow from the
                data; of these, a law that is not linear in its parameters is excluded as soon as
                its error shows that it is not recommended
    leave_out   RunSplit(), LevelSplit("contraction"), LevelSplit("pressure"), SpecimenSplit() or
                BlockSplit(); it defines the purpose of the ranking: the best law for other muscles
                is not the best for the measured ones. By default the first of specimens, runs and
                levels with three groups or more
    loss        LeastSquares(), or a robust loss such as Huber(scale) with its scale in force [N];
                all errors are then rms errors of residuals that are limited to `loss.limit`, and a
                note states the limit
    workers     number of processes, for several of which a script needs `if __name__ ==
                "__main__":`, or an executor
    progress    called with the name of each candidate and the completed fraction, at the end with
                an empty name

    The recommended law is the one with the fewest parameters among those whose error is not larger
    than the lowest one by more than one standard error of the difference (Breiman et al.,
    Classification and Regression Trees (1984), section 3.4.3), and by at most a quarter (chosen):
    where one group dominates the difference, its standard error is as large as the difference. With
    fewer than six groups (chosen) the standard error is uncertain, and a simpler law is preferred
    only where AICc on the rows of the fit does not exclude it. A law that pulls where a muscle was
    measured slack, and no measured force contradicts it, is not recommended. Raises
    IdentificationError where the data cannot compare laws (`support_of`), or no candidate is
    determined.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    support_of(runs).check(DataUse.COMPARISON)
    splits = (leave_out or default_split(runs),)
    (comparison,) = compare_splits(
        runs, candidates, splits, loss=loss, workers=workers, progress=progress
    )
    return comparison


def compare_splits(
    runs: Sequence[Recording],
    candidates: Sequence[Candidate] | None,
    splits: Sequence[GroupSplit],
    *,
    loss: Loss = LeastSquares(),
    workers: Workers = 1,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[Comparison, ...]:
    """A comparison for each split, as `compare`; every candidate is fitted once to all rows."""
    points = FitPoints.from_recordings(runs)
    folds = [ComparedPoints.of(runs, split, points) for split in splits]
    compared, unavailable = started_candidates(runs) if candidates is None else (candidates, ())
    scores = score_candidates(
        compared, folds, loss, workers, progress, can_exclude=candidates is None
    )
    comparisons = []
    for split, of_split in zip(splits, zip(*scores, strict=True), strict=True):
        ranking = [model for model in of_split if isinstance(model, RankedModel)]
        excluded = tuple(model for model in of_split if isinstance(model, ExcludedModel))
        if not ranking:
            reasons = [part for e in excluded for part in (f"\n{e.name}: ", e.reason)]
            text = f"the data determine none of the {len(excluded)} candidates."
            raise IdentificationError(HintedText(text, *reasons))
        ranking = in_order(ranking, lambda m: m.cross_validated_rmse, lambda m: m.parameter_count)
        recommended, reason = recommend(ranking, split)
        of_lengths = length_notes(find_length_errors(recommended.fit.model, runs))
        remarks = (*recommended.fit.notes, *of_lengths, *_tie_notes(ranking))
        if np.isfinite(recommended.limit):
            remarks += (_limit_note(recommended),)
        comparisons.append(
            Comparison(tuple(ranking), excluded, split, recommended, reason, unavailable, remarks)
        )
    return tuple(comparisons)


def _tie_notes(ranking: Sequence[RankedModel]) -> list[str]:
    """The sentence on laws with equal errors; none without them."""
    groups = tied_groups(ranking, lambda model: model.cross_validated_rmse)
    ties = [
        " and ".join(m.candidate.name for m in sorted(group, key=lambda m: m.parameter_count))
        for group in groups
        if len(group) > 1
    ]
    text = (
        f"Equal errors in cross-validation: {'; '.join(ties)}. They stand in the order of their"
        " numbers of parameters."
    )
    return [text] if ties else []


def _limit_note(model: RankedModel) -> str:
    """The definition of the errors for a robust loss, and the number of limited rows of a law."""
    rows = sum(score.rows for score in model.fold_scores)
    many = model.limited_rows > MAX_LIMITED * rows
    advice = (
        " These are more than outliers: the law does not describe them, or the files differ."
        if many
        else ""
    )
    return (
        "In all errors of the ranking, residuals count at most as six robust standard deviations"
        " (1.4826 times the median magnitude), at least as the scale of the robust loss:"
        f" {model.limit:.4g} N for {model.candidate.name}, which limits {model.limited_rows} of"
        f" {rows} rows.{advice}"
    )
