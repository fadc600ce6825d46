"""Selection of one law for two purposes: further runs of the measured muscles, and other muscles of the same type."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from ..core.errors import IdentificationError
from ..recording import Recording
from .candidates import Candidate, standard_candidates
from .cross_validation import RunSplit, SpecimenSplit
from .model_selection import Comparison, RankedModel, compare


@dataclasses.dataclass(frozen=True, eq=False)
class JointSelection:
    """The law with the least maximum, over the purposes, of the ratio of its error to the lowest one; `print` it."""

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
            best = comparison.ranking[0]
            lines.append(
                f"For {comparison.purpose}: rms error {model.cross_validated_rmse:.4g} N, {100 * (ratio - 1):.2g} % "
                f"above the lowest, {best.cross_validated_rmse:.4g} N of {best.candidate.name}."
            )
        return "\n".join(lines)


def select_for_both(
    recordings: Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> JointSelection:
    """One law for further runs (leave-one-run-out) and for other muscles (leave-one-specimen-out cross-validation).

    candidates  by default `standard_candidates`
    progress    called with the name of each candidate and the completed fraction

    Raises IdentificationError where no candidate is determined for both purposes.
    """
    compared = standard_candidates(recordings) if candidates is None else candidates
    splits = (RunSplit(), SpecimenSplit())
    comparisons = tuple(
        compare(recordings, compared, leave_out=split, progress=_part(progress, number, len(splits)))
        for number, split in enumerate(splits)
    )
    rankings = [{model.candidate.name: model for model in each.ranking} for each in comparisons]
    names = [name for name in rankings[0] if all(name in ranking for ranking in rankings)]
    if not names:
        raise IdentificationError(
            "no candidate is determined without each run and without each specimen. Measure at more levels of pressure "
            "and contraction, or give candidates with fewer parameters."
        )

    def ratios(name: str) -> tuple[float, ...]:
        pairs = zip(rankings, comparisons, strict=True)
        return tuple(r[name].cross_validated_rmse / c.ranking[0].cross_validated_rmse for r, c in pairs)

    best = min(names, key=lambda name: (max(ratios(name)), rankings[0][name].parameter_count))
    return JointSelection(comparisons, tuple(ranking[best] for ranking in rankings), ratios(best))


def _part(
    progress: Callable[[str, float], None] | None, number: int, count: int
) -> Callable[[str, float], None] | None:
    """The progress of one of several comparisons as a part of the whole."""
    return None if progress is None else lambda name, fraction: progress(name, (number + fraction) / count)
