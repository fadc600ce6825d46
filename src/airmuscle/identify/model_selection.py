"""Model selection by cross-validation."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ..characteristic.base import Characteristic
from ..core.arrays import Array
from ..core.errors import AirmuscleError, IdentificationError
from ..core.hints import HintedText
from ..recording import Recording
from .candidates import Candidate, standard_candidates, unavailable_candidates
from .compared_points import ComparedPoints, cause_of, residuals_of_rows
from .cross_validation import GroupSplit, default_split, label_folds
from .length_errors import find_length_errors, length_notes
from .loss import LeastSquares, Loss
from .model_evidence import aicc
from .result import Fit
from .static_fit import fit_to_points


@dataclasses.dataclass(frozen=True)
class FoldScore:
    """The out-of-sample error of a law on one fold."""

    fold: str
    rmse: float
    """Root mean square error in force [N]."""
    rows: int


@dataclasses.dataclass(frozen=True, eq=False)
class RankedModel:
    """A candidate whose parameters the data determine, with its scores."""

    candidate: Candidate
    fit: Fit
    in_sample_rmse: float
    """Root mean square error in force [N] on the rows of the fit."""
    cross_validated_rmse: float
    """Root mean square error in force [N] on the rows left out, over all folds."""
    aicc: float
    """Akaike's information criterion of the in-sample errors in force, corrected for small samples."""
    fold_scores: tuple[FoldScore, ...]
    notes: tuple[str, ...] = ()
    """Remarks on the use of the law at the measured points."""

    @property
    def parameter_count(self) -> int:
        """Number of fitted parameters; specimen effects count with their effective number, rounded."""
        return count_parameters(self.fit)


def count_parameters(fit: Fit) -> int:
    """Number of estimates, and the rounded effective number of the specimen effects."""
    return len(fit.estimates) + (0 if fit.effects is None else round(fit.effects.degrees_of_freedom))


@dataclasses.dataclass(frozen=True)
class ExcludedModel:
    """A candidate whose parameters the data do not determine, or that gives no force at measured points, with the
    reason."""

    name: str
    reason: str
    """The complete reason, with what to do."""
    cause: str
    """The cause in one phrase."""

    def __str__(self) -> str:
        return f"{self.name}: {self.cause}."


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """The ranked models, lowest cross-validated error first, and the excluded candidates; `print` it."""

    ranking: tuple[RankedModel, ...]
    excluded: tuple[ExcludedModel, ...]
    leave_out: GroupSplit
    recommended: RankedModel
    reason: str
    unavailable: tuple[ExcludedModel, ...] = ()
    """Standard candidates whose initial values do not follow from the data; empty if candidates were given."""

    notes: tuple[str, ...] = ()
    """Remarks on the data, such as a resting length that is probably recorded wrongly."""

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

    def _left_out(self) -> tuple[tuple[str, tuple[ExcludedModel, ...]], ...]:
        return (("excluded", self.excluded), ("not compared", self.unavailable))

    def __str__(self) -> str:
        title = (
            f"Leave-one-{self.leave_out.group_name}-out cross-validation, rms errors in force; the ranking is for "
            f"{self.purpose}."
        )
        head = f"{'law':<40}{'parameters':>11}{'in sample':>12}{'left out':>12}{'AICc':>12}"
        rows = [
            f"{m.candidate.name:<40}{m.parameter_count:>11}{m.in_sample_rmse:>10.4g} N"
            f"{m.cross_validated_rmse:>10.4g} N{m.aicc:>12.1f}"
            for m in self.ranking
        ]
        notes = [f"note: {note}" for note in self.notes]
        notes += [f"note: {m.candidate.name}: {note}" for m in self.ranking for note in m.notes]
        excluded = [f"{word}: {e}" for word, models in self._left_out() for e in models]
        return "\n".join([title, "", head, *rows, "", self.reason, *notes, *excluded])


def compare(
    recordings: Recording | Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    loss: Loss = LeastSquares(),
    progress: Callable[[str, float], None] | None = None,
) -> Comparison:
    """Fit all candidates, rank them by their cross-validated error in force, and recommend one.

    candidates  by default `standard_candidates`, the laws whose initial values follow from the data
    leave_out   RunSplit(), LevelSplit("contraction"), LevelSplit("pressure"), SpecimenSplit() or BlockSplit(); it
                defines the purpose of the ranking: the best law for other muscles is not the best for the measured
                ones. By default the first of specimens, runs and levels with three groups or more
    progress    called with the name of each candidate and the completed fraction, at the end with an empty name

    The recommended law is the one with the fewest parameters among those whose error is not larger than the lowest one
    by more than one standard error of the difference (Breiman et al., Classification and Regression Trees (1984),
    section 3.4.3). Raises IdentificationError where no candidate is determined.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    split = leave_out or default_split(runs)
    labels, names = label_folds(runs, split)
    points = ComparedPoints.from_recordings(runs, labels, names)
    ranking, excluded = [], []
    compared = standard_candidates(runs) if candidates is None else candidates
    for number, candidate in enumerate(compared):
        if progress is not None:
            progress(candidate.name, number / len(compared))
        try:
            ranking.append(_cross_validate(candidate, points, loss))
        except AirmuscleError as error:
            excluded.append(ExcludedModel(candidate.name, error.message, cause_of(error)))
    if progress is not None:
        progress("", 1.0)
    if not ranking:
        reasons = [part for e in excluded for part in (f"\n{e.name}: ", e.reason)]
        raise IdentificationError(HintedText(f"the data determine none of the {len(excluded)} candidates.", *reasons))
    missing = () if candidates is not None else unavailable_candidates(runs)
    unavailable = tuple(ExcludedModel(name, reason, cause) for name, reason, cause in missing)
    ranking.sort(key=lambda m: (m.cross_validated_rmse, m.parameter_count))
    recommended, reason = _recommend(ranking, split)
    remarks = length_notes(find_length_errors(recommended.fit.model, runs))
    return Comparison(tuple(ranking), tuple(excluded), split, recommended, reason, unavailable, remarks)


def _cross_validate(candidate: Candidate, points: ComparedPoints, loss: Loss) -> RankedModel:
    full_fit = fit_to_points(candidate.law, points.points, loss=loss, fixed=candidate.fixed)
    notes = _slack_notes(full_fit.model, points)
    in_sample = residuals_of_rows(full_fit.model, points.rows, points.max_force)
    left_out = [each for each in points.left_out_residuals(candidate, full_fit, loss) if each[1].size]
    scores = tuple(FoldScore(name, _rms(residuals), residuals.size) for name, residuals in left_out)
    out_of_sample = np.concatenate([residuals for _, residuals in left_out])
    criterion = aicc(float(np.mean(in_sample**2)), in_sample.size, count_parameters(full_fit))
    return RankedModel(candidate, full_fit, _rms(in_sample), _rms(out_of_sample), criterion, scores, notes)


def _slack_notes(model: Characteristic, points: ComparedPoints) -> tuple[str, ...]:
    """A remark where the law is slack at points with a positive force.

    Raises IdentificationError where it gives no force although it is not slack.
    """
    slack, count = points.slack_count(model)
    if not slack:
        return ()
    return (
        f"it is slack at {slack} of {count} points with a positive force and is ranked with zero force there; its "
        "method force raises SolveError at these points.",
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _recommend(ranking: Sequence[RankedModel], split: GroupSplit) -> tuple[RankedModel, str]:
    """The model by the one-standard-error rule, and the reason as a sentence with the numbers."""
    best = ranking[0]
    equivalent = [m for m in ranking if _excess_error(m, best) <= 0]
    recommended = min(equivalent, key=lambda m: (m.parameter_count, m.cross_validated_rmse))
    text = (
        f"Recommended for {split.purpose}: {recommended.candidate.name} with {recommended.parameter_count} parameters, "
        f"rms error {recommended.cross_validated_rmse:.4g} N in leave-one-{split.group_name}-out cross-validation"
    )
    if recommended is best:
        return recommended, f"{text}, the lowest of all."
    return recommended, (
        f"{text}. The error of {best.candidate.name} with {best.parameter_count} parameters, "
        f"{best.cross_validated_rmse:.4g} N, is not lower by more than one standard error of the difference."
    )


def _excess_error(model: RankedModel, best: RankedModel) -> float:
    """Difference of the mean square errors [N^2], minus one standard error of it over the folds."""
    pairs = zip(model.fold_scores, best.fold_scores, strict=True)
    difference = np.array([a.rmse**2 - b.rmse**2 for a, b in pairs])
    rows = np.array([score.rows for score in best.fold_scores], dtype=float)
    mean = float(np.average(difference, weights=rows))
    spread = float(np.sqrt(np.average((difference - mean) ** 2, weights=rows) / max(difference.size - 1, 1)))
    return mean - spread
