"""Model selection by cross-validation."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic
from ..core.arrays import Array
from ..core.errors import AirmuscleError, IdentificationError
from ..core.hints import HintedText
from ..recording import Recording
from .candidates import Candidate, standard_candidates
from .cross_validation import GroupSplit, Labels, default_split, label_folds
from .fit_points import FitPoints
from .force_evaluation import evaluate_force, slack_rows
from .loss import LeastSquares, Loss
from .model_evidence import aicc
from .result import Fit
from .static_fit import fit, refit


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
        """Number of fitted parameters."""
        return len(self.fit.estimates)


@dataclasses.dataclass(frozen=True)
class ExcludedModel:
    """A candidate whose parameters the data do not determine, or that gives no force at measured points, with the
    reason."""

    name: str
    reason: str


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """The ranked models, lowest cross-validated error first, and the excluded candidates; `print` it."""

    ranking: tuple[RankedModel, ...]
    excluded: tuple[ExcludedModel, ...]
    leave_out: GroupSplit
    recommended: RankedModel
    reason: str

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
        notes = [f"note: {m.candidate.name}: {note}" for m in self.ranking for note in m.notes]
        excluded = [f"excluded: {e.name}. {e.reason}" for e in self.excluded]
        return "\n".join([title, "", head, *rows, "", self.reason, *notes, *excluded])


def compare(
    recordings: Recording | Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    loss: Loss = LeastSquares(),
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Fit all candidates, rank them by their cross-validated error in force, and recommend one.

    candidates  by default `standard_candidates`, the laws whose initial values follow from the data
    leave_out   RunSplit(), LevelSplit("contraction"), LevelSplit("pressure"), SpecimenSplit() or BlockSplit(); it
                defines the purpose of the ranking: the best law for other muscles is not the best for the measured
                ones. By default the first of specimens, runs and levels with three groups or more
    progress    called with the name of each candidate

    The recommended law is the one with the fewest parameters among those whose error is not larger than the lowest one
    by more than one standard error of the difference (Breiman et al., Classification and Regression Trees (1984),
    section 3.4.3). Raises IdentificationError where no candidate is determined.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    split = leave_out or default_split(runs)
    labels, names = label_folds(runs, split)
    points = _ComparedPoints.from_recordings(runs, labels, names)
    ranking, excluded = [], []
    for candidate in candidates if candidates is not None else standard_candidates(runs):
        if progress is not None:
            progress(candidate.name)
        try:
            ranking.append(_cross_validate(candidate, points, loss))
        except AirmuscleError as error:
            excluded.append(ExcludedModel(candidate.name, error.message))
    if not ranking:
        reasons = [part for e in excluded for part in (f"\n{e.name}: ", e.reason)]
        raise IdentificationError(HintedText(f"the data determine none of the {len(excluded)} candidates.", *reasons))
    ranking.sort(key=lambda m: (m.cross_validated_rmse, m.parameter_count))
    recommended, reason = _recommend(ranking, split)
    return Comparison(tuple(ranking), tuple(excluded), split, recommended, reason)


class _Fold(NamedTuple):
    """The points to which a law is fitted, and the recordings that are left out of them."""

    name: str
    training: FitPoints
    test: list[Recording]


class _ComparedPoints(NamedTuple):
    """All recordings, their maximum force [N] and the folds; their sensors are estimated once for all candidates."""

    recordings: Sequence[Recording]
    max_force: float
    folds: tuple[_Fold, ...]

    @classmethod
    def from_recordings(
        cls, runs: Sequence[Recording], labels: Sequence[Labels], names: Sequence[str]
    ) -> _ComparedPoints:
        """The points divided into the folds of these names."""
        folds = []
        for name in names:
            training = [_select(run, label != name) for run, label in zip(runs, labels, strict=True)]
            test = [_select(run, label == name) for run, label in zip(runs, labels, strict=True)]
            folds.append(
                _Fold(
                    name,
                    FitPoints.from_recordings([run for run in training if len(run)]),
                    [run for run in test if len(run)],
                )
            )
        return cls(runs, max(float(np.nanmax(run["force"])) for run in runs), tuple(folds))


def _select(run: Recording, mask: npt.NDArray[np.bool_]) -> Recording:
    return run if mask.all() else run.rows(mask)


def _cross_validate(candidate: Candidate, points: _ComparedPoints, loss: Loss) -> RankedModel:
    full_fit = fit(candidate.law, points.recordings, loss=loss, fixed=candidate.fixed)
    max_force = 3 * points.max_force
    notes = _slack_notes(full_fit.model, points.recordings)
    in_sample = force_residuals(full_fit.model, points.recordings, max_force)
    scores, out_of_sample = [], []
    for fold in points.folds:
        try:
            model = refit(full_fit.model, fold.training, loss=loss, fixed=candidate.fixed)
        except AirmuscleError as error:
            raise IdentificationError(HintedText(f"Not determined without {fold.name}: ", error.message)) from None
        residuals = force_residuals(model, fold.test, max_force)
        if residuals.size:
            scores.append(FoldScore(fold.name, _rms(residuals), residuals.size))
            out_of_sample.append(residuals)
    criterion = aicc(float(np.mean(in_sample**2)), in_sample.size, len(full_fit.estimates))
    return RankedModel(
        candidate, full_fit, _rms(in_sample), _rms(np.concatenate(out_of_sample)), criterion, tuple(scores), notes
    )


def force_residuals(model: Characteristic, runs: Sequence[Recording], max_force: float) -> Array:
    """Residuals (model - measured) in force [N] at the rows with a positive force, with the law of each run's length.

    `max_force` [N] limits the force of laws that give contraction or pressure.
    """
    return np.concatenate(
        [
            evaluate_force(law, rows["pressure"], rows["contraction"], max_force) - rows["force"]
            for law, rows in _laws_with_rows(model, runs)
        ]
    )


def _laws_with_rows(model: Characteristic, runs: Sequence[Recording]) -> Iterator[tuple[Any, Recording]]:
    """The rows of each run with a positive force, with the law of the run's resting length."""
    for run in runs:
        rows = run.rows((run["force"] > 0) & np.isfinite(run["pressure"] + run["contraction"] + run["force"]))
        law: Any = model
        length = run.constants.get("resting_length")
        if length is not None and hasattr(law, "with_resting_length"):
            law = law.with_resting_length(float(length))
        yield law, rows


def _slack_notes(model: Characteristic, runs: Sequence[Recording]) -> tuple[str, ...]:
    """A remark where the law is slack at points with a positive force.

    Raises IdentificationError where it gives no force although it is not slack.
    """
    masks = [slack_rows(law, rows["pressure"], rows["contraction"]) for law, rows in _laws_with_rows(model, runs)]
    slack = sum(int(np.count_nonzero(mask)) for mask in masks)
    if not slack:
        return ()
    return (
        f"it is slack at {slack} of {sum(mask.size for mask in masks)} points with a positive force and is ranked "
        "with zero force there; its method force raises SolveError at these points.",
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
