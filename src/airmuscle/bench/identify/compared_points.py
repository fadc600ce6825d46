"""Compared points: the rows of all recordings with their cross-validation folds, shared by all candidate laws."""

import dataclasses
import functools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array, HintedText, IdentificationError, tree
from ...physics.muscle.characteristic import Characteristic, PooledLengthLaw
from ...recording import Recording
from .candidates import Candidate, evaluate_force, slack_rows
from .cross_validation import Labels, specimen_name
from .fit_points import FitPoints
from .group_refits import GroupRefits
from .pooling import Pooling, make_pooling
from .problem import FitProblem, with_length
from .result import Fit
from .slack import SlackPull, pull_limit, slack_pull, with_slack_bounds
from .solver import LeastSquaresSolution, design_matrix, is_linear
from .static_fit import refit
from .weighting import LeastSquares, Loss

FORCE_MARGIN = 3.0
"""Limit of the force of laws that give contraction or pressure, in maxima of the measured force (chosen)."""


class EvaluatedRows(NamedTuple):
    """The complete rows of a recording [SI], and its resting length [m] if it is known; a force of 0 or less is that of
    a slack muscle."""

    pressure: Array
    contraction: Array
    force: Array
    resting_length: float | None
    specimen: str = ""

    @property
    def measured(self) -> npt.NDArray[np.bool_]:
        """Mask of the rows with a positive force."""
        return np.asarray(self.force > 0)


def evaluated_rows(run: Recording, rows: npt.NDArray[np.bool_] | None = None) -> EvaluatedRows:
    """The rows of a recording, or those of a mask, in which the errors of laws in force are evaluated."""
    pressure, contraction, force = (run[name] for name in ("pressure", "contraction", "force"))
    mask = np.isfinite(pressure + contraction + force)
    if rows is not None:
        mask &= rows
    length = run.constants.get("resting_length")
    return EvaluatedRows(pressure[mask], contraction[mask], force[mask], None if length is None else float(length),
                         specimen_name(run))  # fmt: skip


def law_of_length(law: Characteristic, length: float | None, specimen: str = "") -> Any:
    """The law of a specimen if it is known, else of a muscle with this resting length [m], if the law depends on it."""
    if isinstance(law, PooledLengthLaw) and specimen in law.specimens:
        return law.for_specimen(specimen)
    return with_length(law, length)


def force_residuals(model: Characteristic, runs: Sequence[Recording], max_force: float) -> Array:
    """Residuals (model - measured) in force [N] at the rows with a positive force, with the law of each run's length.

    `max_force` [N] limits the force of laws that give contraction or pressure.
    """
    return residuals_of_rows(model, [evaluated_rows(run, run["force"] > 0) for run in runs], max_force)


def residuals_of_rows(model: Characteristic, parts: Sequence[EvaluatedRows], max_force: float) -> Array:
    """Residuals (model - measured) in force [N] at these rows, at a slack row the force of the law, which should be 0;
    one evaluation of the law for each resting length, of a pooled law for each specimen."""
    residuals: list[Array] = [np.zeros(0)] * len(parts)
    by_specimen = isinstance(model, PooledLengthLaw)
    muscles = [(part.resting_length, part.specimen if by_specimen else "") for part in parts]
    for muscle in dict.fromkeys(muscles):
        same = [i for i, each in enumerate(muscles) if each == muscle]
        pressure, contraction = (np.concatenate([parts[i][column] for i in same]) for column in (0, 1))
        forces = evaluate_force(law_of_length(model, *muscle), pressure, contraction, max_force)
        ends = np.cumsum([parts[i].force.size for i in same])[:-1]
        for i, modelled in zip(same, np.split(forces, ends), strict=True):
            residuals[i] = modelled - np.maximum(parts[i].force, 0.0)
    return np.concatenate(residuals)


def cause_of(error: AirmuscleError) -> str:
    """The cause of an error in one phrase."""
    return getattr(error, "cause", "") or "the fit fails"


class LeftOutGroup(NamedTuple):
    """A group of rows that is left out: its name, and the mask of its rows in each recording."""

    name: str
    masks: list[npt.NDArray[np.bool_]]


@dataclasses.dataclass(frozen=True, eq=False)
class ComparedPoints:
    """All recordings and the folds. Sensors, runs and branches are estimated once for all candidates."""

    recordings: Sequence[Recording]
    labels: Sequence[Labels]
    folds: tuple[LeftOutGroup, ...]
    points: FitPoints
    """The rows of all recordings."""

    @classmethod
    def from_recordings(
        cls, runs: Sequence[Recording], labels: Sequence[Labels], names: Sequence[str], points: FitPoints | None = None
    ) -> "ComparedPoints":
        """The points divided into the folds of these names; `points` are those of the recordings, if they exist."""
        folds = tuple(LeftOutGroup(name, [label == name for label in labels]) for name in names)
        return cls(runs, labels, folds, points or FitPoints.from_recordings(runs))

    @functools.cached_property
    def max_force(self) -> float:
        """Limit of the force [N] of laws that give contraction or pressure."""
        return FORCE_MARGIN * max(float(np.nanmax(run["force"])) for run in self.recordings)

    @functools.cached_property
    def rows(self) -> list[EvaluatedRows]:
        """The evaluated rows of each recording."""
        return [evaluated_rows(run) for run in self.recordings]

    @functools.cached_property
    def _left_out_rows(self) -> list[list[EvaluatedRows]]:
        return [
            [evaluated_rows(run, mask) for run, mask in zip(self.recordings, fold.masks, strict=True) if mask.any()]
            for fold in self.folds
        ]

    @functools.cached_property
    def rows_of_folds(self) -> list[int]:
        """The number of rows that count in each fold, as in `FoldScore`."""
        counts = [[(int(np.count_nonzero(p.measured)), p.force.size) for p in parts] for parts in self._left_out_rows]
        return [sum(n for n, _ in fold) or sum(n for _, n in fold) for fold in counts]

    @functools.cached_property
    def _group(self) -> npt.NDArray[np.intp]:
        """The index of the fold of each complete row; one more than the last for rows that are never left out."""
        group = np.full(len(self.points.joined), len(self.folds))
        for i, fold in enumerate(self.folds):
            group[np.concatenate(fold.masks)] = i
        return group[~self.points.missing]

    @functools.cached_property
    def measured(self) -> npt.NDArray[np.bool_]:
        """Mask of the evaluated rows with a positive force."""
        return np.concatenate([part.measured for part in self.rows])

    @functools.cached_property
    def joined_rows(self) -> dict[str, npt.NDArray[Any]]:
        """Pressure, contraction, force and specimen of the evaluated rows."""
        columns = {n: np.concatenate([getattr(r, n) for r in self.rows]) for n in ("pressure", "contraction", "force")}
        return {**columns, "specimen": np.repeat([r.specimen for r in self.rows], [r.force.size for r in self.rows])}

    def rms(self, residuals: Array) -> float:
        """Root mean square [N] of the residuals of the evaluated rows (N,); those of slack rows are added to the rows
        with a positive force."""
        return float(np.sqrt(residuals @ residuals / max(int(np.count_nonzero(self.measured)), 1)))

    def slack_pull(self, residuals: Array, rmse: float) -> SlackPull:
        """The force at the slack rows of a law with these residuals of the evaluated rows (N,) and this error [N]."""
        rows = self.joined_rows
        limit = pull_limit(rmse, float(np.max(rows["force"], initial=0.0)))
        modelled = residuals + np.maximum(rows["force"], 0.0)
        return slack_pull(rows["pressure"], rows["contraction"], rows["force"], modelled, limit, rows["specimen"])

    def slack_notes(self, model: Characteristic) -> tuple[str, ...]:
        """A remark where the law is slack at points with a positive force.

        Raises IdentificationError where it gives no force although it is not slack.
        """
        masks = [
            slack_rows(law_of_length(model, r.resting_length), r.pressure[r.measured], r.contraction[r.measured])
            for r in self.rows
        ]
        slack, count = sum(int(np.count_nonzero(mask)) for mask in masks), sum(mask.size for mask in masks)
        text = (
            f"it is slack at {slack} of {count} points with a positive force and is ranked with zero force there; its "
            "method force raises SolveError at these points."
        )
        return (text,) if slack else ()

    def left_out_residuals(self, candidate: Candidate, fit: Fit, loss: Loss) -> Iterator[tuple[str, Array, int]]:
        """The name of each fold, the residuals in force [N] on its rows of the law fitted to all other rows, and the
        number of its rows with a positive force.

        Raises IdentificationError where the other rows do not determine the parameters.
        """
        law, refits = candidate.law, self._refits_of(fit) if isinstance(loss, LeastSquares) else None
        pooling = make_pooling(law, self.points, fit.problem) if isinstance(law, PooledLengthLaw) else None
        for i, (fold, rows) in enumerate(zip(self.folds, self._left_out_rows, strict=True)):
            model = None if refits is None else refits.law_without(i, pooling)
            if model is None:
                model = self._refit_exactly(candidate, fit, fold, loss)
            count = sum(int(np.count_nonzero(part.measured)) for part in rows)
            yield fold.name, residuals_of_rows(model, rows, self.max_force), count

    def _refits_of(self, fit: Fit) -> "_FoldRefits":
        """The refits of a population law without each fold; kept for the next law of the same population."""
        if not self._kept_refits or self._kept_refits[0].problem is not fit.problem:
            self._kept_refits[:] = [_FoldRefits(fit, self._group, len(self.folds), self.points)]
        return self._kept_refits[0]

    @functools.cached_property
    def _kept_refits(self) -> "list[_FoldRefits]":
        return []

    def _refit_exactly(self, candidate: Candidate, fit: Fit, fold: LeftOutGroup, loss: Loss) -> Characteristic:
        """The refit by a search of its own."""
        training = [
            run if not mask.any() else run.rows(~mask) for run, mask in zip(self.recordings, fold.masks, strict=True)
        ]
        try:
            points = FitPoints.from_recordings([run for run in training if len(run)])
            return refit(fit.model, points, loss=loss, fixed=candidate.fixed)
        except AirmuscleError as error:
            cause = f"without {fold.name}, {cause_of(error)}"
            message = HintedText(f"Not determined without {fold.name}: ", error.message)
            raise IdentificationError(message, cause=cause) from None


class _FoldRefits:
    """The laws fitted to all groups but one, from the fit to all rows; of pooled laws the population."""

    def __init__(self, fit: Fit, group: npt.NDArray[np.intp], count: int, points: FitPoints) -> None:
        self.problem, self._group = fit.problem, group
        if points.kept.get("problem") is not fit.problem:  # not yet for another split
            bounded = with_slack_bounds(fit.problem, points)
            points.kept.update(problem=fit.problem, bounded=(bounded, _solution(bounded.problem, fit.values)))
        bounded, solution = points.kept["bounded"]
        self._refits = GroupRefits(bounded.problem, solution, bounded.groups(group, points, count), count + 1)
        self._counts, self._values = np.ones(count + 1) - np.eye(count, count + 1), dict[int, Array | None]()

    def law_without(self, index: int, pooling: Pooling | None) -> Characteristic | None:
        """The law without one group; None where the refit is not certain."""
        if index not in self._values:
            self._values[index] = self._refits.refit(self._counts[index])
        values = self._values[index]
        if values is None:
            return None
        problem, rows = self.problem, self._group != index
        law: Any = tree.with_parameters(problem.law, problem.leaf_values(values))
        if hasattr(law, "rescaled"):
            law = law.rescaled(*((float(x[rows].min()), float(x[rows].max())) for x in problem.arguments))
        model: Characteristic = law if pooling is None else pooling.law(law, values, rows)
        return model


def _solution(problem: FitProblem, values: Array) -> LeastSquaresSolution:
    """The solution with these parameters (P,), with its Jacobian."""
    if not is_linear(problem):
        return LeastSquaresSolution(values, problem.predict(values), problem.jacobian(values))
    matrix, constant = design_matrix(problem)
    return LeastSquaresSolution(values, matrix @ values + constant, matrix)
