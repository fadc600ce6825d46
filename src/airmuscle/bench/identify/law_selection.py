"""Selection of a law for one purpose or for two: further runs of measured muscles, and other muscles of the type."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from ...core.errors import IdentificationError
from ...core.short_repr import ShortRepr
from ...engine.processes import Workers
from ...recording import Recording
from .candidate_scores import RankedModel
from .candidates import MIN_POOLED, Candidate
from .cross_validation import GroupSplit, RunSplit, SpecimenSplit, specimen_name
from .model_selection import Comparison, compare, compare_splits, eligible_models, is_equivalent
from .weighting import LeastSquares, Loss

SPLITS = (RunSplit(), SpecimenSplit())
"""The splits of the two purposes."""
MAX_JOINT_EXCESS = 0.05
"""Maximum excess of the error of a simpler law over the lowest one, for each purpose (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class JointSelection(ShortRepr):
    """One law for two purposes, with its errors relative to the lowest ones; `print` it."""

    comparisons: tuple[Comparison, ...]
    """One for each purpose."""
    recommended: tuple[RankedModel, ...]
    """The law in the ranking of each comparison."""
    ratios: tuple[float, ...]
    """Cross-validated error of the law divided by the lowest error, for each purpose."""

    def __str__(self) -> str:
        name, count = self.recommended[0].candidate.name, self.recommended[0].parameter_count
        lines = [f"One law for all purposes: {name} with {count} parameters."]
        for comparison, model, ratio in zip(self.comparisons, self.recommended, self.ratios, strict=True):
            best = eligible_models(comparison.ranking)[0]
            lines.append(
                f"For {comparison.purpose}: rms error {model.cross_validated_rmse:.4g} N, {100 * (ratio - 1):.2g} % "
                f"above the lowest, {best.cross_validated_rmse:.4g} N of {best.candidate.name}."
            )
        return "\n".join(lines)


def select_for_both(
    recordings: Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    loss: Loss = LeastSquares(),
    workers: Workers = 1,
    progress: Callable[[str, float], None] | None = None,
) -> JointSelection:
    """One law for further runs (leave-one-run-out) and for other muscles (leave-one-specimen-out cross-validation).

    candidates  by default `standard_candidates`, of which slow laws may be excluded as in `compare`
    loss        as in `compare`
    workers     number of processes, as in `compare`
    progress    called with the name of each candidate and the completed fraction

    Laws that pull where a muscle was measured slack are not eligible. The best law has the smallest maximum, over the
    purposes, of the ratio of its error to the lowest one. Of the
    candidates that are worse for neither purpose by more than one standard error of the difference, and by at most 5 %
    than the best law of each purpose, the one with the fewest parameters is recommended.
    Raises IdentificationError where no candidate is determined for both purposes.
    """
    comparisons = compare_splits(recordings, candidates, SPLITS, loss=loss, workers=workers, progress=progress)
    rankings = [{model.candidate.name: model for model in eligible_models(each.ranking)} for each in comparisons]
    names = [name for name in rankings[0] if all(name in ranking for ranking in rankings)]
    if not names:
        raise IdentificationError(
            "no candidate is determined without each run and without each specimen. Measure at more levels of pressure "
            "and contraction, or give candidates with fewer parameters."
        )

    lowest = [min(model.cross_validated_rmse for model in ranking.values()) for ranking in rankings]

    def ratios(name: str) -> tuple[float, ...]:
        return tuple(r[name].cross_validated_rmse / error for r, error in zip(rankings, lowest, strict=True))

    best = min(names, key=lambda name: (max(ratios(name)), rankings[0][name].parameter_count))
    limit = max(1 + MAX_JOINT_EXCESS, *ratios(best))
    equivalent = [name for name in names if max(ratios(name)) <= limit and _equivalent_for_both(name, best, rankings)]
    chosen = min(equivalent, key=lambda name: (rankings[0][name].parameter_count, max(ratios(name))))
    return JointSelection(comparisons, tuple(ranking[chosen] for ranking in rankings), ratios(chosen))


def _equivalent_for_both(name: str, best: str, rankings: Sequence[Mapping[str, RankedModel]]) -> bool:
    """Whether a law is equivalent to the best one for each purpose."""
    return all(is_equivalent(ranking[name], ranking[best]) for ranking in rankings)


@dataclasses.dataclass(frozen=True, eq=False)
class LawSelection:
    """The recommended law, with the comparison for one purpose or those for both."""

    comparisons: tuple[Comparison, ...]
    recommended: RankedModel
    reason: str


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

    candidates  as in `compare`
    leave_out   the split of a single purpose, as in `compare`
    both        whether one law must serve both purposes; by default if no split is given and the recordings contain
                three specimens or more, each in several runs
    loss, workers, progress  as in `compare`

    Raises IdentificationError where no candidate is determined.
    """
    if both or (both is None and leave_out is None and serves_both(recordings)):
        joint = select_for_both(recordings, candidates, loss=loss, workers=workers, progress=progress)
        return LawSelection(joint.comparisons, joint.recommended[0], str(joint))
    comparison = compare(recordings, candidates, leave_out=leave_out, loss=loss, workers=workers, progress=progress)
    return LawSelection((comparison,), comparison.recommended, comparison.reason)


def serves_both(recordings: Sequence[Recording]) -> bool:
    """Whether there are three specimens or more, each with several runs."""
    counts = Counter(specimen_name(run) for run in recordings)
    return len(counts) >= MIN_POOLED and min(counts.values()) > 1
