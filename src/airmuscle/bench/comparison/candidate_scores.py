"""Scores of candidate laws: their fit to all rows, and their errors on the rows left out by one or
several splits; in this process or in several."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core import AirmuscleError, Array, tree
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...physics.muscle.characteristic import PooledLengthLaw
from ..estimation import LeastSquares, Loss, aicc, effective_sample_size
from ..statics import (
    FORCE,
    Candidate,
    ExcludedModel,
    Fit,
    SlackPull,
    fit_to_points,
    fitted_quantity_of,
    linear_fields,
    population_of,
)
from .compared_points import ComparedPoints, LeftOutFold, cause_of, residuals_of_rows

MAX_RECOMMENDED_EXCESS = 0.25
"""Maximum excess of the error of a recommended law over the lowest one (chosen)."""
MAX_EXCESS = 2.0
"""Ratio to the lowest cross-validated error of other laws above which a law is not cross-validated
further (chosen). The error on rows left out is never lower than that on the rows of the fit, nor
the sum of squares over all folds lower than that over some."""


@dataclasses.dataclass(frozen=True)
class FoldScore:
    """The out-of-sample error of a law on one fold."""

    fold: str
    rmse: float
    """Root mean square error in force [N] of the measured rows; the squared forces of the law at
    slack rows are added."""
    rows: int
    """Number of rows with a positive force; of a fold without any, the number of its slack rows."""
    slack_force: float = 0.0
    """Greatest force [N] of the law at the slack rows of the fold."""

    @classmethod
    def of(cls, fold: LeftOutFold, limit: float = np.inf) -> "FoldScore":
        """The score for the residuals of a fold, limited to `limit` [N]."""
        rows = fold.measured or fold.residuals.size
        errors = np.clip(fold.residuals, -limit, limit)
        rmse = float(np.sqrt(errors @ errors / rows))
        return cls(
            fold.name,
            rmse,
            rows,
            fold.slack_force,
        )


@dataclasses.dataclass(frozen=True, eq=False)
class RankedModel:
    """A candidate whose parameters the data determine, with its scores; root mean square errors in
    force [N].
    """

    candidate: Candidate
    fit: Fit
    in_sample_rmse: float
    """That on the rows of the fit, as in `FoldScore`."""
    cross_validated_rmse: float
    """That on the rows left out, over all folds."""
    aicc: float
    """Akaike's information criterion of the in-sample errors in force, corrected for small
    samples.
    """
    fold_scores: tuple[FoldScore, ...]
    slack: SlackPull
    """The force of the law at the slack rows of the fit."""
    effective_rows: float
    """Number of independent rows that are equivalent to those of the fit, by the autocorrelation of
    the residuals.
    """
    notes: tuple[str, ...] = ()
    """Remarks on the use of the law at the measured points."""
    limit: float = np.inf
    """Limit of the residuals in all errors [N], that of a robust loss; infinite for least
    squares.
    """
    limited_rows: int = 0
    """Number of rows of the fit whose residual is limited."""

    @property
    def parameter_count(self) -> int:
        """Number of fitted parameters; specimen effects count with their effective number,
        rounded.
        """
        return count_parameters(self.fit)


def count_parameters(fit: Fit) -> int:
    """Number of estimates, and the rounded effective number of the specimen effects."""
    return len(fit.estimates) + (
        0 if fit.effects is None else round(fit.effects.degrees_of_freedom)
    )


Score = RankedModel | ExcludedModel


def score_candidate(
    candidate: Candidate, splits: Sequence[ComparedPoints], loss: Loss, limits: Sequence[float]
) -> tuple[Score, ...]:
    """The scores of a candidate for each split; without further folds above `limits` [N], if there
    are any.
    """
    try:
        quantity = fitted_quantity_of(candidate.law)
        own_loss = loss
        if not isinstance(loss, LeastSquares) and quantity != FORCE:
            # The scale, a force [N], in proportion to the medians of the magnitudes of both
            # quantities (chosen).
            columns = (splits[0].points.joined[name] for name in (quantity.name, "force"))
            own, force = (float(np.nanmedian(np.abs(column))) for column in columns)
            scale = loss.scale * own / force if min(own, force) > 0 else loss.scale
            own_loss = dataclasses.replace(loss, scale=scale)  # type: ignore[type-var]  # each loss is a dataclass
        fit = fit_to_points(candidate.law, splits[0].points, loss=own_loss, fixed=candidate.fixed)
        notes = splits[0].slack_notes(fit.model)
        residuals = residuals_of_rows(fit.model, splits[0].rows, splits[0].max_force)
    except AirmuscleError as error:
        return (ExcludedModel(candidate.name, error.message, cause_of(error)),) * len(splits)
    limit = loss.limit(residuals[splits[0].rows.measured])
    return tuple(
        _cross_validate(candidate, points, own_loss, fit, residuals, notes, bound, limit)
        for points, bound in zip(splits, limits or [np.inf] * len(splits), strict=True)
    )


def _cross_validate(
    candidate: Candidate,
    points: ComparedPoints,
    loss: Loss,
    fit: Fit,
    residuals: Array,
    notes: tuple[str, ...],
    bound: float,
    limit: float,
) -> Score:
    """The scores for one split; residuals in force [N] are limited to `limit`, which is infinite
    for least squares.
    """
    in_sample = np.clip(residuals, -limit, limit)
    left_out = list[FoldScore]()
    measured_rows = int(np.count_nonzero(points.rows.measured))
    rmse = float(np.sqrt(in_sample @ in_sample / max(measured_rows, 1)))
    if rmse > bound:
        return _excess_error(candidate.name, rmse, bound, "on the rows of the fit")
    count = sum(
        int(np.count_nonzero(rows.measured)) or rows.force.size for rows in points.left_out_rows
    )
    try:
        for fold in points.left_out_residuals(candidate, fit, loss):
            if fold.residuals.size:
                left_out.append(FoldScore.of(fold, limit))
            least = float(np.sqrt(sum(score.rmse**2 * score.rows for score in left_out) / count))
            if least > bound:
                return _excess_error(
                    candidate.name,
                    least,
                    bound,
                    f"without {fold.name} and the groups before it alone",
                )
    except AirmuscleError as error:
        return ExcludedModel(candidate.name, error.message, cause_of(error))
    rows = np.array([score.rows for score in left_out])
    return RankedModel(
        candidate,
        fit,
        rmse,
        cross_validated_rmse=float(
            np.sqrt(np.average([score.rmse**2 for score in left_out], weights=rows))
        ),
        aicc=aicc(rmse**2, measured_rows, count_parameters(fit)),
        fold_scores=tuple(left_out),
        slack=points.slack_pull(residuals, rmse),
        effective_rows=effective_sample_size(in_sample[points.rows.measured]),
        notes=notes,
        limit=limit,
        limited_rows=int(np.count_nonzero(np.abs(residuals) > limit)),
    )


def _excess_error(name: str, rmse: float, limit: float, where: str) -> ExcludedModel:
    error = f"error {where}, {rmse:.4g} N, is above {limit:.4g} N, so that it cannot be recommended"
    cause = f"its cross-validation takes long and was not completed: its {error}"
    omitted = (
        "its cross-validation takes long and was not completed. To complete it, give the law as a"
        " candidate."
    )
    return ExcludedModel(name, f"Its {error}; {omitted}", cause, rmse)


def score_candidates(
    candidates: Sequence[Candidate],
    splits: Sequence[ComparedPoints],
    loss: Loss,
    workers: Workers,
    progress: Callable[[str, float], None] | None,
    *,
    can_exclude: bool,
) -> list[tuple[Score, ...]]:
    """The scores of each candidate for each split, in the order of the candidates. With
    `can_exclude` the laws that are not linear in all parameters, whose fits take longest, are
    scored last, and not cross-validated further where they cannot be recommended. The scores do not
    depend on the number of workers."""
    early, late = _early_and_late(candidates, can_exclude=can_exclude)
    scores_of: dict[int, tuple[Score, ...]] = {}
    with process_pool(workers, one_thread_each=True) as pool:
        if pool is not None:
            for split in splits:
                _ = split.points.findings  # before they are sent
        distribution = DistributedCalls(pool, _score_tasks, (tuple(splits), loss))
        for indices in (early, late):
            lowest = _lowest_errors(list(scores_of.values()))
            groups = _of_one_population(candidates, indices, longest_first=pool is not None)
            limits = {i: [max_excess(candidates[i]) * error for error in lowest] for i in indices}
            tasks = [[(candidates[i], limits[i]) for i in group] for group in groups]
            for position, scores in distribution.completed(tasks):
                for i, score in zip(groups[position], scores, strict=True):
                    scores_of[i] = score
                    if progress is not None:
                        progress(candidates[i].name, (len(scores_of) - 1) / len(candidates))
    if progress is not None:
        progress("", 1.0)
    return [scores_of[i] for i in range(len(candidates))]


def _early_and_late(
    candidates: Sequence[Candidate], *, can_exclude: bool
) -> tuple[list[int], list[int]]:
    """The candidates that are scored first, and those that may then be excluded."""
    late = []
    if can_exclude:
        late = [i for i, law in enumerate(candidates) if max_excess(law) < float("inf")]
    return [i for i in range(len(candidates)) if i not in late], late


def _lowest_errors(scores_of: Sequence[tuple[Score, ...]]) -> list[float]:
    """The lowest cross-validated error of the laws for each split."""
    lowest = []
    for scores in zip(*scores_of, strict=True):
        ranked = [score for score in scores if isinstance(score, RankedModel)]
        lowest.append(min((model.cross_validated_rmse for model in ranked), default=np.inf))
    return lowest


def _of_one_population(
    candidates: Sequence[Candidate], indices: Sequence[int], *, longest_first: bool
) -> list[list[int]]:
    """The candidates in groups of one population law, whose fits are computed once."""
    of_population: dict[Any, list[int]] = {}
    for i in indices:
        structure = tree.structure(population_of(candidates[i].law))
        of_population.setdefault(structure, []).append(i)
    groups = list(of_population.values())

    def size(group: Sequence[int]) -> int:
        return sum(len(list(tree.leaves(candidates[i].law))) for i in group)

    return sorted(groups, key=size, reverse=True) if longest_first else groups


def max_excess(candidate: Candidate) -> float:
    """The ratio to the lowest error of other laws above which a law is not cross-validated further.
    That of a recommended law for those whose fits take longest, because they are linear in some of
    their fitted parameters only, and a greater one for other laws that are not linear."""
    fields = linear_fields(candidate.law)
    if isinstance(candidate.law, PooledLengthLaw):
        return float("inf")
    if not fields:
        return MAX_EXCESS
    names = {
        leaf.path.partition("[")[0] for leaf in tree.leaves(candidate.law) if leaf.declared.fitted
    }
    return float("inf") if names <= set(fields) else 1.0 + MAX_RECOMMENDED_EXCESS


def _score_tasks(
    common: tuple[Sequence[ComparedPoints], Loss],
    tasks: Sequence[tuple[Candidate, Sequence[float]]],
) -> list[tuple[Score, ...]]:
    return [score_candidate(candidate, *common, limits) for candidate, limits in tasks]
