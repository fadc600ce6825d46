"""Errors of the specimens that were left out of a fit in turn, and the band for a specimen that was
not measured.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ...core import AirmuscleError, Hint, HintedText
from ...physics.muscle.characteristic.base import Characteristic
from ...recording import Recording
from .. import comparison
from ..estimation import (
    MIN_MEMBERS,
    SpecimenSplit,
    leverages,
    resting_lengths_of,
    specimens_of,
    t_quantile,
)
from ..statics import Candidate, Fit

MIN_JUDGED = 4
"""Number of specimens from which one that does not follow the others is named (chosen): of three,
the others are two, which hardly determine how the law depends on the length."""
ODD_RATIO = 2.0
"""Ratio of the error of a specimen to the median of those of the others above which it does not
follow them (chosen: the median is robust against the one; normal errors of ten rows or more differ
by less)."""


@dataclasses.dataclass(frozen=True)
class SpecimenErrors:
    """The rms error in force [N] of each specimen, predicted by the law that was fitted to the
    others.
    """

    names: tuple[str, ...]
    rms: tuple[float, ...]
    lengths: tuple[float, ...] = ()
    """Resting lengths [m] of the specimens, by which the law depends on them; empty if it does
    not.
    """

    slack_forces: tuple[float, ...] = ()
    """Greatest force [N] of the law where each specimen was measured slack; empty if it is not
    known."""

    @property
    def slack_force(self) -> float | None:
        """Greatest force [N] of the law where a specimen was measured slack, if it exceeds the band
        of another specimen; None if it does not."""
        greatest = max(self.slack_forces, default=0.0)
        return greatest if greatest > self.half_width else None

    @property
    def deviation(self) -> float:
        """Standard deviation [N] of the error of a specimen about the regression of the specimens
        by ln L_0.
        """
        places = self.lengths or [1.0] * len(self.rms)
        remaining = np.maximum(1.0 - leverages(places, places), 0.0)
        return float(np.sqrt(np.mean(remaining * np.square(self.rms))))

    @property
    def half_width(self) -> float:
        """Half width [N] of the 95 % band of another specimen, at the geometric mean of the resting
        lengths.
        """
        count = len(self.rms)
        return t_quantile(count - 1) * self.deviation * math.sqrt(1.0 + 1.0 / count)

    @property
    def odd(self) -> tuple[str, float, float] | None:
        """The specimen that does not follow the others, its rms error, and the median of those of
        the others [N]. None unless there are four specimens or more and the greatest error exceeds
        `ODD_RATIO` times that median.
        """
        worst = int(np.argmax(self.rms))
        median = (
            float(np.median(np.delete(self.rms, worst)))
            if len(self.rms) >= MIN_JUDGED
            else math.inf
        )
        return (
            (self.names[worst], self.rms[worst], median)
            if self.rms[worst] > ODD_RATIO * median
            else None
        )

    def __str__(self) -> str:
        count = len(self.rms)
        each = ", ".join(
            f"{name} {error:.3g} N" for name, error in zip(self.names, self.rms, strict=True)
        )
        return (
            f"{count} specimens left out in turn (rms errors {each}), whose standard deviation"
            f" about the law, {self.deviation:.3g} N, is multiplied by {t_quantile(count - 1):.3g},"
            f" the 95 % quantile of Student's t with {count - 1} degrees of freedom, and increased"
            " by the uncertainty of the law, which grows with the distance from the measured"
            " lengths"
        )


def specimen_notes(errors: SpecimenErrors | None) -> list[HintedText]:
    """The remarks on a specimen that does not follow the others, and on the force of the law where
    a specimen that was left out is slack; empty without them."""
    return [*odd_specimen_notes(errors), *slack_specimen_notes(errors)]


def slack_specimen_notes(errors: SpecimenErrors | None) -> list[HintedText]:
    """The remark on a law that pulls, by more than its band, where a specimen that was left out is
    slack."""
    force = None if errors is None else errors.slack_force
    if errors is None or force is None:
        return []
    name = errors.names[int(np.argmax(errors.slack_forces))]
    return [
        HintedText(
            f"The pressure at which a specimen starts to pull is not predicted well: left out,"
            f" specimen {name} was slack where the law gives up to {force:.3g} N; the 95 % band of"
            f" another specimen is {errors.half_width:.3g} N. For a length that was not measured,"
            " do not rely on smaller forces: measure the pressure at which the muscle starts to"
            " pull at its greatest contraction."
        )
    ]


def odd_specimen_notes(errors: SpecimenErrors | None) -> list[HintedText]:
    """The remark on a specimen that does not follow the others; empty without one."""
    found = None if errors is None else errors.odd
    if errors is None or found is None:
        return []
    name, error, others = found
    lengths = errors.lengths
    extrapolated = ""
    if len(lengths) == len(errors.names) and lengths[errors.names.index(name)] in (
        min(lengths),
        max(lengths),
    ):
        extrapolated = (
            " Its length is outside those of the others, so that the law is extrapolated to it."
        )
    return [
        HintedText(
            f"Specimen {name} does not follow the others: left out, its rms error is {error:.3g} N,"
            f" that of the others {others:.3g} N (median).{extrapolated} Compare its length, its"
            " product and its fittings with those of the others.",
            Hint(
                "To test whether its length is recorded wrongly",
                function="bench.estimate_length_error",
            ),
        )
    ]


def specimen_errors(
    fit: Fit, recordings: Sequence[Recording], fixed: tuple[str, ...] = ()
) -> SpecimenErrors | None:
    """The errors of the specimens left out of a fit, by refits from its parameters; `fixed` are
    those kept fixed. None for fewer than three specimens, or where the others do not determine the
    law."""
    if len(specimens_of(recordings)) < MIN_MEMBERS:
        return None
    try:
        points = comparison.ComparedPoints.of(recordings, SpecimenSplit())
        parts = [
            fold
            for fold in points.left_out_residuals(Candidate("", fit.model, fixed), fit, fit.loss)
            if fold.residuals.size
        ]
    except AirmuscleError:  # the others do not determine the law, so that no error is known
        return None
    return _checked([comparison.FoldScore.of(part) for part in parts], fit.model, recordings)


def ranked_specimen_errors(
    model: "comparison.RankedModel",
    comparisons: "Sequence[comparison.Comparison]",
    recordings: Sequence[Recording],
) -> SpecimenErrors | None:
    """As `specimen_errors`, for a law of comparisons; from that which left the specimens out, if
    there is one.
    """
    for compared in comparisons:
        if isinstance(compared.leave_out, SpecimenSplit) and specimens_of(recordings):
            return _checked(compared[model.candidate.name].fold_scores, model.fit.model, recordings)
    return specimen_errors(model.fit, recordings, model.candidate.fixed)


def _checked(
    scores: "Sequence[comparison.FoldScore]", law: Characteristic, recordings: Sequence[Recording]
) -> SpecimenErrors | None:
    names = tuple(score.fold for score in scores)
    rms = tuple(score.rmse for score in scores)
    if len(rms) < MIN_MEMBERS or not np.isfinite(rms).all() or max(rms) == 0.0:
        return None
    lengths = resting_lengths_of(recordings) if hasattr(law, "with_resting_length") else {}
    return SpecimenErrors(
        names,
        rms,
        tuple(lengths[name] for name in names if name in lengths),
        tuple(score.slack_force for score in scores),
    )
