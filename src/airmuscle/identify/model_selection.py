"""Which law to take: every candidate fitted, and judged by what it says of data that it was not given."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..characteristic.base import Characteristic
from ..core.arrays import Array
from ..core.errors import AirmuscleError, IdentificationError
from ..recording import Recording
from .candidates import Candidate, standard_candidates
from .cross_validation import GroupSplit, Labels, default_split, label_folds
from .force_evaluation import evaluate_force
from .loss import LeastSquares, Loss
from .result import Fit
from .static_fit import fit


@dataclasses.dataclass(frozen=True)
class FoldScore:
    """What a law that had not seen a part says of it."""

    fold: str
    rmse: float
    """Root mean square error in force [N]."""
    rows: int


@dataclasses.dataclass(frozen=True, eq=False)
class RankedModel:
    """A candidate that the data determine."""

    candidate: Candidate
    fit: Fit
    in_sample_rmse: float
    """Root mean square error in force [N] on the rows that it was fitted to."""
    cross_validated_rmse: float
    """The same on parts that were left out, each row once [N]."""
    aicc: float
    """n ln(SSE/n) + 2 K + 2 K (K + 1)/(n - K - 1), errors in force, K with the noise's own."""
    fold_scores: tuple[FoldScore, ...]

    @property
    def parameter_count(self) -> int:
        return len(self.fit.estimates)


@dataclasses.dataclass(frozen=True)
class ExcludedModel:
    """A candidate that the data cannot determine, and why."""

    name: str
    reason: str


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """Contenders from the least cross-validated error upwards, and those that were excluded; `print` it."""

    ranking: tuple[RankedModel, ...]
    excluded: tuple[ExcludedModel, ...]
    leave_out: GroupSplit
    recommended: RankedModel
    reason: str

    @property
    def purpose(self) -> str:
        """What the recommended law is for: what was left out decides it."""
        return self.leave_out.purpose

    def __getitem__(self, name: str) -> RankedModel:
        """A contender by its name."""
        found = {contender.candidate.name: contender for contender in self.ranking}
        if name not in found:
            raise IdentificationError(f"no contender '{name}'; there are {', '.join(found)}.")
        return found[name]

    def __str__(self) -> str:
        head = f"{'law':<40}{'parameters':>11}{'in sample':>12}{'left out':>12}{'AICc':>12}"
        rows = [
            f"{c.candidate.name:<40}{c.parameter_count:>11}{c.in_sample_rmse:>10.4g} N{c.cross_validated_rmse:>10.4g} N{c.aicc:>12.1f}"
            for c in self.ranking
        ]
        out = [f"excluded: {e.name}. {e.reason}" for e in self.excluded]
        said = f"Left out in turn: each {self.leave_out.group_name}, so the ranking is for {self.purpose}."
        return "\n".join([said, "", head, *rows, "", self.reason, *out])


def compare(
    recordings: Recording | Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    loss: Loss = LeastSquares(),
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Fit all candidates, rank them by their error on parts that were left out, and recommend one.

    Without `candidates` all laws are tried that can be started from data alone. `leave_out` is RunSplit(),
    Levels("contraction"), Levels("pressure"), SpecimenSplit() or BlockSplit(), and decides what the ranking is for (its
    `purpose`): a law for muscles not measured is not the best one for those measured. Without it the first that the
    data have three of: specimens, runs, levels. All errors are compared in force, whatever a law is solved for. The
    simplest law is recommended that is no worse than the best by more than one standard error of their difference
    (Breiman et al., Classification and Regression Trees (1984), section 3.4.3). Raises IdentificationError where none
    is determined.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    how = leave_out or default_split(runs)
    labels, names = label_folds(runs, how)
    contenders, excluded = [], []
    for candidate in candidates if candidates is not None else standard_candidates(runs):
        if progress is not None:
            progress(candidate.name)
        try:
            contenders.append(_cross_validate(candidate, runs, labels, names, loss))
        except AirmuscleError as error:
            excluded.append(ExcludedModel(candidate.name, str(error)))
    if not contenders:
        whys = "\n".join(f"{e.name}: {e.reason}" for e in excluded)
        raise IdentificationError(f"the data determine none of the {len(excluded)} candidates.\n{whys}")
    contenders.sort(key=lambda c: (c.cross_validated_rmse, c.parameter_count))
    chosen, reason = _recommend(contenders, how)
    return Comparison(tuple(contenders), tuple(excluded), how, chosen, reason)


def _cross_validate(
    candidate: Candidate, runs: Sequence[Recording], labels: Sequence[Labels], names: Sequence[str], loss: Loss
) -> RankedModel:
    whole = fit(candidate.law, runs, loss=loss, fixed=candidate.fixed)
    ceiling = 3 * max(float(np.nanmax(run["force"])) for run in runs)
    everywhere = force_residuals(whole.model, runs, ceiling)
    left_out, errors = [], []
    for name in names:
        others = [run.rows(own != name) for run, own in zip(runs, labels, strict=True) if (own != name).any()]
        these = [run.rows(own == name) for run, own in zip(runs, labels, strict=True) if (own == name).any()]
        try:
            model = fit(whole.model, others, loss=loss, fixed=candidate.fixed).model
        except AirmuscleError as error:
            raise IdentificationError(f"Without {name} it is not determined: {error}") from None
        found = force_residuals(model, these, ceiling)
        if found.size:
            left_out.append(FoldScore(name, _rms(found), found.size))
            errors.append(found)
    return RankedModel(
        candidate, whole, _rms(everywhere), _rms(np.concatenate(errors)), _aicc(everywhere, len(whole.estimates)),
        tuple(left_out),
    )  # fmt: skip


def force_residuals(model: Characteristic, runs: Sequence[Recording], ceiling: float) -> Array:
    """Model less measured force [N] at the rows where the muscle pulled, each run by the law of its length."""
    found = []
    for run in runs:
        rows = run.rows((run["force"] > 0) & np.isfinite(run["pressure"] + run["contraction"] + run["force"]))
        law: Any = model
        rest = run.constants.get("resting_length")
        if rest is not None and hasattr(law, "of_length"):
            law = law.of_length(float(rest))
        found.append(evaluate_force(law, rows["pressure"], rows["contraction"], ceiling) - rows["force"])
    return np.concatenate(found)


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _aicc(errors: Array, parameters: int) -> float:
    """Hurvich and Tsai, Biometrika 76:297 (1989); infinite where there are too few points for it."""
    n, k = errors.size, parameters + 1
    if n - k - 1 <= 0:
        return float("inf")
    return float(n * np.log(max(float(np.mean(errors**2)), 1e-300)) + 2 * k + 2 * k * (k + 1) / (n - k - 1))


def _recommend(contenders: Sequence[RankedModel], how: GroupSplit) -> tuple[RankedModel, str]:
    best = contenders[0]
    close = [c for c in contenders if _excess_error(c, best) <= 0]
    chosen = min(close, key=lambda c: (c.parameter_count, c.cross_validated_rmse))
    said = f"Recommended for {how.purpose}: {chosen.candidate.name}, "
    said += f"{chosen.cross_validated_rmse:.4g} N on each {how.group_name} left out"
    if chosen is best:
        return chosen, f"{said}, the least of all, with {chosen.parameter_count} parameters."
    return chosen, (
        f"{said} with {chosen.parameter_count} parameters: {best.candidate.name} has {best.cross_validated_rmse:.4g} N with "
        f"{best.parameter_count}, which is not better by more than one standard error of the difference."
    )


def _excess_error(contender: RankedModel, best: RankedModel) -> float:
    """Mean square error beyond the best's, less one standard error of that difference over the parts."""
    pairs = zip(contender.fold_scores, best.fold_scores, strict=True)
    difference = np.array([a.rmse**2 - b.rmse**2 for a, b in pairs])
    rows = np.array([part.rows for part in best.fold_scores], dtype=float)
    mean = float(np.average(difference, weights=rows))
    spread = float(np.sqrt(np.average((difference - mean) ** 2, weights=rows) / max(difference.size - 1, 1)))
    return mean - spread
