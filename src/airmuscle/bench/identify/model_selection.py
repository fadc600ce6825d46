"""Model selection by cross-validation."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ...core.errors import HintedText, IdentificationError
from ...core.short_repr import ShortRepr
from ...recording import Recording
from .candidate_scores import ExcludedModel, RankedModel, Score, points_of_splits
from .candidates import Candidate, standard_candidates, unavailable_candidates
from .cross_validation import GroupSplit, default_split
from .length_errors import find_length_errors, length_notes
from .loss import LeastSquares, Loss
from .parallel_scores import score_candidates
from .recommendation import recommend

MAX_LIMITED = 0.01
"""Fraction of the rows above which limited residuals are no outliers (chosen)."""

MAX_LISTED = 10
"""Maximum number of laws in the text of a comparison, besides the recommended one (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Comparison(ShortRepr):
    """The ranked models, lowest cross-validated error first, and the excluded candidates; `print` it."""

    ranking: tuple[RankedModel, ...]
    excluded: tuple[ExcludedModel, ...]
    leave_out: GroupSplit
    recommended: RankedModel
    reason: str
    unavailable: tuple[ExcludedModel, ...] = ()
    """Standard candidates whose initial values do not follow from the data; empty if candidates were given."""

    notes: tuple[str, ...] = ()
    """Remarks on the data and on the fit of the recommended law, such as contradicting rows or two branches."""

    @property
    def purpose(self) -> str:
        """The use for which the recommended law is best; it follows from the groups that were left out."""
        return self.leave_out.purpose

    def __getitem__(self, name: str) -> RankedModel:
        """A ranked model by its name. Raises IdentificationError."""
        models = {model.candidate.name: model for model in self.ranking}
        if name not in models:
            raise IdentificationError(f"the comparison has no model '{name}'; it has {', '.join(models)}.")
        return models[name]

    def _listed(self) -> tuple[RankedModel, ...]:
        """The first models of the ranking, and the recommended one."""
        first = self.ranking[:MAX_LISTED]
        return first if self.recommended in first else (*first, self.recommended)

    def __str__(self) -> str:
        title = (
            f"Leave-one-{self.leave_out.group_name}-out cross-validation, rms errors in force; the ranking is for "
            f"{self.purpose}."
        )
        width = max(40, *(len(m.candidate.name) + 1 for m in self._listed()))
        slack = any(m.slack.rows for m in self.ranking)
        head = f"{'law':<{width}}{'parameters':>11}{'in sample':>12}{'left out':>12}"
        head += f"{'at slack':>13}" * slack + f"{'AICc excess':>13}"
        lowest = min(m.aicc for m in self.ranking)
        rows = [
            f"{m.candidate.name:<{width}}{m.parameter_count:>11}{m.in_sample_rmse:>10.4g} N"
            f"{m.cross_validated_rmse:>10.4g} N" + _at_slack(m) * slack + f"{m.aicc - lowest:>13.1f}"
            for m in self._listed()
        ]
        more = len(self.ranking) - len(rows)
        rows += [f"and {more} more, with larger errors; the report and `ranking` contain all."] if more else []
        notes = [f"note: {note}" for note in self.notes]
        notes += [f"note: {m.candidate.name}: {note}" for m in self._listed() for note in m.notes]
        excluded = [f"excluded: {e}" for e in self.excluded if e.error is None]
        causes = dict.fromkeys(e.cause for e in self.unavailable)
        excluded += [
            f"not compared: {', '.join(e.name for e in self.unavailable if e.cause == c)}: {c}." for c in causes
        ]
        errors = [f"{e.name} ({e.error:.4g} N)" for e in self.excluded if e.error is not None]
        excluded += (
            [f"excluded, as the error is too large (cross-validation ended early): {', '.join(errors)}."]
            if errors
            else []
        )
        remark = [_SLACK_REMARK] if slack else []
        return "\n".join([title, "", head, *rows, *remark, "", self.reason, *notes, *excluded])


_SLACK_REMARK = (
    "at slack: greatest force of the law where the muscle was measured slack.\n"
    "*: more than three rms errors of the law and 2 % of the greatest force; not recommended if another law pulls less."
)


def _at_slack(model: RankedModel) -> str:
    """The column of the greatest force at slack rows."""
    return f"{model.slack.greatest:>10.3g} N{'*' if model.slack.pulling else ' '}"


def compare(
    recordings: Recording | Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    loss: Loss = LeastSquares(),
    workers: int = 1,
    progress: Callable[[str, float], None] | None = None,
) -> Comparison:
    """Fit all candidates, rank them by their cross-validated error in force, and recommend one.

    candidates  by default `standard_candidates`, the laws whose initial values follow from the data; of these, a law
                that is not linear in its parameters is excluded as soon as its error shows that it is not recommended
    leave_out   RunSplit(), LevelSplit("contraction"), LevelSplit("pressure"), SpecimenSplit() or BlockSplit(); it
                defines the purpose of the ranking: the best law for other muscles is not the best for the measured
                ones. By default the first of specimens, runs and levels with three groups or more
    loss        LeastSquares(), or a robust loss such as Huber(scale) with its scale in force [N]; all errors are then
                rms errors of residuals that are limited to `loss.limit`, and a note states the limit
    workers     number of processes; a script that asks for several needs `if __name__ == "__main__":`
    progress    called with the name of each candidate and the completed fraction, at the end with an empty name

    The recommended law is the one with the fewest parameters among those whose error is not larger than the lowest one
    by more than one standard error of the difference (Breiman et al., Classification and Regression Trees (1984),
    section 3.4.3), and by at most a quarter (chosen): where one group dominates the difference, its standard error is
    as large as the difference. With fewer than six groups (chosen) the standard error is uncertain, and a simpler law
    is preferred only where AICc on the rows of the fit does not exclude it. A law that pulls where a muscle was
    measured slack, and no measured force contradicts it, is not recommended. Raises IdentificationError where no
    candidate is determined.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    splits = (leave_out or default_split(runs),)
    (comparison,) = compare_splits(runs, candidates, splits, loss=loss, workers=workers, progress=progress)
    return comparison


def compare_splits(
    runs: Sequence[Recording],
    candidates: Sequence[Candidate] | None,
    splits: Sequence[GroupSplit],
    *,
    loss: Loss = LeastSquares(),
    workers: int = 1,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[Comparison, ...]:
    """A comparison for each split, as `compare`; every candidate is fitted once to all rows."""
    points = points_of_splits(runs, splits)
    compared = standard_candidates(runs) if candidates is None else candidates
    scores = score_candidates(compared, points, loss, workers, progress, can_exclude=candidates is None)
    missing = () if candidates is not None else unavailable_candidates(runs)
    unavailable = tuple(ExcludedModel(name, reason, cause) for name, reason, cause in missing)
    return tuple(_comparison(runs, split, [each[i] for each in scores], unavailable) for i, split in enumerate(splits))


def _comparison(
    runs: Sequence[Recording], split: GroupSplit, scores: Sequence[Score], unavailable: tuple[ExcludedModel, ...]
) -> Comparison:
    ranking = [each for each in scores if isinstance(each, RankedModel)]
    excluded = tuple(each for each in scores if isinstance(each, ExcludedModel))
    if not ranking:
        reasons = [part for e in excluded for part in (f"\n{e.name}: ", e.reason)]
        raise IdentificationError(HintedText(f"the data determine none of the {len(excluded)} candidates.", *reasons))
    ranking.sort(key=lambda m: (m.cross_validated_rmse, m.parameter_count))
    recommended, reason = recommend(ranking, split)
    length_remarks = length_notes(find_length_errors(recommended.fit.model, runs))
    remarks = (*recommended.fit.notes, *length_remarks, *_limit_notes(recommended))
    return Comparison(tuple(ranking), excluded, split, recommended, reason, unavailable, remarks)


def _limit_notes(model: RankedModel) -> tuple[str, ...]:
    """The definition of the errors for a robust loss, and the number of limited rows of a law."""
    if not np.isfinite(model.limit):
        return ()
    rows = sum(score.rows for score in model.fold_scores)
    many = model.limited_rows > MAX_LIMITED * rows
    advice = " These are more than outliers: the law does not describe them, or the files differ." if many else ""
    return (
        "In all errors of the ranking, residuals count at most as six robust standard deviations (1.4826 times the "
        f"median magnitude), at least as the scale of the robust loss: {model.limit:.4g} N for {model.candidate.name}, "
        f"which limits {model.limited_rows} of {rows} rows.{advice}",
    )
