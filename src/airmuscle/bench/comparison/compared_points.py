"""Compared points: the rows of all recordings with their cross-validation folds, shared by all
candidate laws.
"""

import dataclasses
import functools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array, HintedText, IdentificationError, tree
from ...physics.muscle.characteristic import Characteristic, PooledLengthLaw
from ...recording import Recording, resting_length_of
from ..estimation import (
    GroupRefits,
    GroupSplit,
    LeastSquares,
    LeastSquaresSolution,
    Loss,
    RowIndices,
    label_folds,
    specimen_name,
)
from ..inspection import POINT_COLUMNS
from ..statics import (
    FORCE_MARGIN,
    MIN_PULL,
    PULL_RATIO,
    Candidate,
    Fit,
    FitPoints,
    Pooling,
    SlackPull,
    evaluate_force,
    find_lagging_rows,
    make_pooling,
    refit,
    slack_pull,
    slack_rows,
    with_length,
    with_slack_bounds,
)


class EvaluatedRows(NamedTuple):
    """N complete rows of recordings [SI], in which the errors of laws in force are evaluated; a
    force of 0 or less is that of a slack muscle."""

    pressure: Array
    contraction: Array
    force: Array
    run: RowIndices
    """Index of the recording of each row."""
    muscles: tuple[tuple[float | None, str], ...]
    """Resting length [m] of each recording, if it is known, and specimen."""

    @property
    def measured(self) -> npt.NDArray[np.bool_]:
        """Mask of the rows with a positive force."""
        return np.asarray(self.force > 0)

    def at(self, rows: npt.NDArray[np.bool_]) -> "EvaluatedRows":
        """The rows of a mask (N,)."""
        return EvaluatedRows(
            self.pressure[rows],
            self.contraction[rows],
            self.force[rows],
            self.run[rows],
            self.muscles,
        )


def evaluated_rows(runs: Sequence[Recording]) -> EvaluatedRows:
    """The complete rows of recordings."""
    pressure, contraction, force = (
        np.concatenate([run[name] for run in runs]) for name in POINT_COLUMNS
    )
    counts = [len(run) for run in runs]
    index = np.repeat(np.arange(len(runs)), counts)
    lengths = list(map(resting_length_of, runs))
    specimens = list(map(specimen_name, runs))
    muscles = tuple(zip(lengths, specimens, strict=True))
    rows = EvaluatedRows(pressure, contraction, force, index, muscles)
    return rows.at(evaluated_mask(runs))


def evaluated_mask(runs: Sequence[Recording]) -> npt.NDArray[np.bool_]:
    """The mask of the complete rows of recordings, without those that the force has not yet
    reached after a jump of the pressure.
    """
    columns = [np.concatenate([run[name] for run in runs]) for name in POINT_COLUMNS]
    complete = np.isfinite(np.stack(columns)).all(axis=0)
    return np.asarray(complete & ~find_lagging_rows(runs).joined)


def law_of_length(law: Characteristic, length: float | None, specimen: str = "") -> Any:
    """The law of a specimen if it is known, else of a muscle with this resting length [m], if the
    law depends on it.
    """
    if isinstance(law, PooledLengthLaw) and specimen in law.specimens:
        return law.for_specimen(specimen)
    return with_length(law, length)


def force_residuals(model: Characteristic, runs: Sequence[Recording], max_force: float) -> Array:
    """Residuals (model - measured) in force [N] at the rows with a positive force, with the law of
    each run's length. `max_force` [N] limits the force of laws that give contraction or
    pressure."""
    rows = evaluated_rows(runs)
    return residuals_of_rows(model, rows.at(rows.measured), max_force)


def residuals_of_rows(model: Characteristic, rows: EvaluatedRows, max_force: float) -> Array:
    """Residuals (model - measured) in force [N] at these rows, at a slack row the force of the law,
    which should be 0; one evaluation of the law for each resting length, of a pooled law for each
    specimen."""
    by_specimen = isinstance(model, PooledLengthLaw)
    residuals = np.zeros(rows.force.size)
    muscles = [(length, specimen if by_specimen else "") for length, specimen in rows.muscles]
    distinct = list(dict.fromkeys(muscles))
    member = np.array([distinct.index(muscle) for muscle in muscles])[rows.run]
    for i in np.unique(member):
        of_length = member == i
        forces = evaluate_force(
            law_of_length(model, *distinct[i]),
            rows.pressure[of_length],
            rows.contraction[of_length],
            max_force,
        )
        residuals[of_length] = forces - np.maximum(rows.force[of_length], 0.0)
    return residuals


def _slack_pull_of_rows(rows: EvaluatedRows, residuals: Array, permitted: float) -> SlackPull:
    """The force at the slack rows of a law with these residuals (N,), of which `permitted` [N], and
    a part of the greatest force, do not count."""
    greatest = float(np.max(rows.force, initial=0.0))
    limit = max(permitted, MIN_PULL * greatest)
    modelled = residuals + np.maximum(rows.force, 0.0)
    specimens = [name for _, name in rows.muscles]
    specimen = np.array(specimens)[rows.run]
    return slack_pull(rows.pressure, rows.contraction, rows.force, modelled, limit, specimen)


class LeftOutFold(NamedTuple):
    """The rows of a fold, with the residuals in force [N] (N,) of the law fitted to all others."""

    name: str
    rows: EvaluatedRows
    residuals: Array

    @property
    def measured(self) -> int:
        """Number of rows with a positive force."""
        return int(np.count_nonzero(self.rows.measured))

    @property
    def slack_force(self) -> float:
        """Greatest force [N] of the law at the slack rows that no measured force contradicts."""
        return _slack_pull_of_rows(self.rows, self.residuals, 0.0).greatest


def cause_of(error: AirmuscleError) -> str:
    """The cause of an error in one phrase."""
    return getattr(error, "cause", "") or "the fit fails"


@dataclasses.dataclass(frozen=True, eq=False)
class ComparedPoints:
    """All recordings and the folds. Sensors, runs and branches are estimated once for all
    candidates.
    """

    recordings: Sequence[Recording]
    folds: Sequence[str]
    """Names of the groups that are left out in turn."""
    fold_of_rows: RowIndices
    """Index of the fold of each row; one more than the last for rows that are never left out."""
    points: FitPoints
    """The rows of all recordings."""
    _kept_refits: "list[_FoldRefits]" = dataclasses.field(
        default_factory=list, init=False, repr=False
    )

    @classmethod
    def of(
        cls, runs: Sequence[Recording], split: GroupSplit, points: FitPoints | None = None
    ) -> "ComparedPoints":
        """The points divided into the groups of a split; `points` are those of the recordings, if
        they exist. Raises IdentificationError for fewer than two groups."""
        labels, names = label_folds(runs, split)
        joined = np.concatenate(labels)
        fold_of_rows = np.full(joined.size, len(names))
        for i, name in enumerate(names):
            fold_of_rows[joined == name] = i
        return cls(runs, names, fold_of_rows, points or FitPoints.from_recordings(runs))

    @functools.cached_property
    def max_force(self) -> float:
        """Limit of the force [N] of laws that give contraction or pressure."""
        return FORCE_MARGIN * float(np.nanmax(self.points.joined["force"]))

    @functools.cached_property
    def rows(self) -> EvaluatedRows:
        """The evaluated rows of all recordings."""
        return evaluated_rows(self.recordings)

    @functools.cached_property
    def left_out_rows(self) -> list[EvaluatedRows]:
        """The evaluated rows of each fold."""
        fold = self.fold_of_rows[evaluated_mask(self.recordings)]
        return [self.rows.at(fold == i) for i in range(len(self.folds))]

    def slack_pull(self, residuals: Array, rmse: float) -> SlackPull:
        """The force at the slack rows of a law with these residuals of the evaluated rows (N,) and
        this error [N].
        """
        return _slack_pull_of_rows(self.rows, residuals, PULL_RATIO * rmse)

    def slack_notes(self, model: Characteristic) -> tuple[str, ...]:
        """A remark where the law is slack at points with a positive force. Raises
        IdentificationError where it gives no force although it is not slack."""
        rows = self.rows
        slack = 0
        count = int(np.count_nonzero(self.rows.measured))
        for i, (length, _) in enumerate(rows.muscles):
            measured = rows.at(self.rows.measured & (rows.run == i))
            slack += int(
                np.count_nonzero(
                    slack_rows(
                        law_of_length(model, length), measured.pressure, measured.contraction
                    )
                )
            )
        text = (
            f"it is slack at {slack} of {count} points with a positive force and is ranked with"
            " zero force there; its method force raises SolveError at these points."
        )
        return (text,) if slack else ()

    def left_out_residuals(
        self, candidate: Candidate, fit: Fit, loss: Loss
    ) -> Iterator[LeftOutFold]:
        """Each fold with the residuals in force [N] on its rows of the law fitted to all other
        rows. Raises IdentificationError where the other rows do not determine the parameters."""
        law = candidate.law
        refits = None
        if isinstance(loss, LeastSquares):
            if not self._kept_refits or self._kept_refits[0].problem is not fit.problem:
                group = self.fold_of_rows[~self.points.missing]
                self._kept_refits[:] = [_FoldRefits(fit, group, len(self.folds), self.points)]
            refits = self._kept_refits[0]  # also for the next law of the same population
        pooling = (
            make_pooling(law, self.points, fit.problem)
            if isinstance(law, PooledLengthLaw)
            else None
        )
        for i, (name, rows) in enumerate(zip(self.folds, self.left_out_rows, strict=True)):
            model = None if refits is None else refits.law_without(i, pooling)
            if model is None:
                model = self._refit_exactly(candidate, fit, i, loss)
            yield LeftOutFold(name, rows, residuals_of_rows(model, rows, self.max_force))

    def _refit_exactly(
        self, candidate: Candidate, fit: Fit, fold: int, loss: Loss
    ) -> Characteristic:
        """The refit by a search of its own."""
        ends = np.cumsum([len(run) for run in self.recordings])[:-1]
        parts = zip(self.recordings, np.split(self.fold_of_rows != fold, ends), strict=True)
        try:
            parts_used = [
                run if selected.all() else run.rows(selected)
                for run, selected in parts
                if selected.any()
            ]
            return refit(
                fit.model, FitPoints.from_recordings(parts_used), loss=loss, fixed=candidate.fixed
            )
        except AirmuscleError as error:
            without = f"without {self.folds[fold]}"
            message = HintedText(f"Not determined {without}: ", error.message)
            raise IdentificationError(message, cause=f"{without}, {cause_of(error)}") from None


class _FoldRefits:
    """The laws fitted to all groups but one, from the fit to all rows; of pooled laws the
    population.
    """

    def __init__(self, fit: Fit, group: RowIndices, count: int, points: FitPoints) -> None:
        self.problem = fit.problem
        self._group = group
        if points.kept.get("problem") is not fit.problem:  # not yet for another split
            bounded = with_slack_bounds(fit.problem, points)
            values = fit.values
            if bounded.problem.is_linear:
                matrix, constant = bounded.problem.design_matrix()
                solution = LeastSquaresSolution(values, matrix @ values + constant, matrix)
            else:
                solution = bounded.problem.solution(values)
            points.kept.update(problem=fit.problem, bounded=(bounded, solution))
        bounded, solution = points.kept["bounded"]
        self._refits = GroupRefits(
            bounded.problem, solution, bounded.groups(group, points, count), count + 1
        )
        self._counts, self._values = (
            np.ones(count + 1) - np.eye(count, count + 1),
            dict[int, Array | None](),
        )

    def law_without(self, index: int, pooling: Pooling | None) -> Characteristic | None:
        """The law without one group; None where the refit is not certain."""
        if index not in self._values:
            self._values[index] = self._refits.refit(self._counts[index])
        values = self._values[index]
        if values is None:
            return None
        problem = self.problem
        rows = self._group != index
        law: Any = tree.with_parameters(problem.law, problem.leaf_values(values))
        if hasattr(law, "rescaled"):
            law = law.rescaled(
                *((float(x[rows].min()), float(x[rows].max())) for x in problem.arguments)
            )
        model: Characteristic = (
            law if pooling is None else pooling.law(law, pooling.predict(values, rows))
        )
        return model
