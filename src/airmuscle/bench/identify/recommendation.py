"""Recommendation of a law of a ranking: eligible laws, the one-standard-error rule, and the evidence for few folds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .candidate_scores import RankedModel
from .cross_validation import GroupSplit
from .model_evidence import aicc

MAX_EXCESS = 0.25
"""Maximum excess of the error of a recommended law over the lowest one (chosen)."""
MIN_FOLDS = 6
"""Number of folds from which the standard error of their differences decides alone (chosen): the relative standard
error of a standard deviation of k normal values is 1/sqrt(2(k - 1)), 50 % for three folds and 32 % for six."""
MAX_AICC_EXCESS = 10.0
"""Excess of AICc above which a model has essentially no support (Burnham and Anderson, Model Selection and Multimodel
Inference (2002), section 2.6)."""


def eligible_models(ranking: Sequence[RankedModel]) -> list[RankedModel]:
    """The models that do not pull where a muscle was measured slack, in their order, and those that pull no more there
    than any of them does: the limit of a law grows with its error, which must not favour a worse law. All models where
    each pulls."""
    least = min((model.slack.greatest for model in ranking if not model.slack.pulling), default=np.inf)
    return [model for model in ranking if not model.slack.pulling or model.slack.greatest <= least]


def recommend(ranking: Sequence[RankedModel], split: GroupSplit) -> tuple[RankedModel, str]:
    """The model by the one-standard-error rule within `MAX_EXCESS`, and the reason as a sentence with the numbers.

    ranking  models with the folds of one split, lowest cross-validated error first
    """
    eligible = eligible_models(ranking)
    best = eligible[0]
    limit = (1 + MAX_EXCESS) * best.cross_validated_rmse
    equivalent = [m for m in eligible if m.cross_validated_rmse <= limit and excess_error(m, best) <= 0]
    supported = [m for m in equivalent if not is_contradicted(m, best)]
    recommended = min(supported, key=_simplicity)
    text = (
        f"Recommended for {split.purpose}: {recommended.candidate.name} with {recommended.parameter_count} parameters, "
        f"rms error {recommended.cross_validated_rmse:.4g} N in leave-one-{split.group_name}-out cross-validation"
    )
    if recommended is best:
        text += ", the lowest of all." if best is ranking[0] else ", the lowest of the laws that may be recommended."
    else:
        text += (
            f". The error of {best.candidate.name} with {best.parameter_count} parameters, "
            f"{best.cross_validated_rmse:.4g} N, is not lower by more than one standard error of the difference."
        )
    simpler = min(equivalent, key=_simplicity)
    return recommended, text + _contradiction(simpler, recommended, best) + _pulling(ranking, recommended)


def _simplicity(model: RankedModel) -> tuple[int, float]:
    return model.parameter_count, model.cross_validated_rmse


def _contradiction(simpler: RankedModel, recommended: RankedModel, best: RankedModel) -> str:
    """The sentence on a simpler law that the rows of the fit contradict; empty without one."""
    if simpler is recommended:
        return ""
    return (
        f" {simpler.candidate.name} with {simpler.parameter_count} parameters is within one standard error, which "
        f"{len(best.fold_scores)} folds do not determine well; on the rows of the fit its error is "
        f"{simpler.in_sample_rmse:.4g} N against {best.in_sample_rmse:.4g} N, more than their noise explains."
    )


def _pulling(ranking: Sequence[RankedModel], recommended: RankedModel) -> str:
    """The sentence on laws with a lower error that pull where a muscle is slack; empty without them."""
    if recommended.slack.pulling:
        return f" No law pulls less where a muscle was measured slack; of this one, {recommended.slack}."
    eligible = eligible_models(ranking)
    better = [m for m in ranking if m not in eligible and m.cross_validated_rmse < recommended.cross_validated_rmse]
    if not better:
        return ""
    more = f" and {len(better) - 1} more" if len(better) > 1 else ""
    return (
        f" Not recommended, although its error is lower: {better[0].candidate.name}{more}, because "
        f"{better[0].slack}, more than {better[0].slack.limit:.3g} N."
    )


def is_equivalent(model: RankedModel, best: RankedModel) -> bool:
    """Whether a law is not worse than the best one by more than one standard error of the difference, and the rows of
    the fit do not contradict it where the folds are few."""
    return excess_error(model, best) <= 0 and not is_contradicted(model, best)


def is_contradicted(model: RankedModel, best: RankedModel) -> bool:
    """Whether there are few folds and AICc on the rows of the fit gives a law no support against the best one.

    The rows count with their effective number, because their residuals are correlated.
    """
    if len(best.fold_scores) >= MIN_FOLDS:
        return False
    own, other = (aicc(each.in_sample_rmse**2, best.effective_rows, each.parameter_count) for each in (model, best))
    return bool(np.isfinite(other) and own - other > MAX_AICC_EXCESS)


def excess_error(model: RankedModel, best: RankedModel) -> float:
    """Difference of the mean square errors [N^2], minus one standard error of it over the folds."""
    pairs = zip(model.fold_scores, best.fold_scores, strict=True)
    difference = np.array([a.rmse**2 - b.rmse**2 for a, b in pairs])
    rows = np.array([score.rows for score in best.fold_scores], dtype=float)
    mean = float(np.average(difference, weights=rows))
    spread = float(np.sqrt(np.average((difference - mean) ** 2, weights=rows) / max(difference.size - 1, 1)))
    return mean - spread
