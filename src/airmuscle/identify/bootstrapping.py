"""A fit repeated on runs drawn anew: how sure its parameters are where rows of one run repeat each other."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic
from ..core import tree
from ..core.arrays import Array
from ..core.errors import IdentificationError
from ..recording import Recording
from .cross_validation import GroupSplit, default_split
from .loss import LeastSquares
from .problem import FitProblem
from .result import Fit
from .solver import design_matrix, is_linear, solve

RowIndices = npt.NDArray[np.intp]
_MIN_EIGENVALUE = 1e-10
"""Least eigenvalue of a refit's normal matrix, in the basis where that of all rows is one (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Bootstrap:
    """Parameters of every refit, shape (refits, P); a refit that its runs do not determine is a row of NaN."""

    fit: Fit
    values: Array
    group_count: int
    seed: int

    @property
    def standard_errors(self) -> Array:
        return np.asarray(np.nanstd(self.values, axis=0, ddof=1))

    @property
    def failed_refits(self) -> int:
        """Refits whose runs do not determine the parameters."""
        return int(np.isnan(self.values).any(axis=1).sum())

    def intervals(self, level: float = 0.95) -> Array:
        """Lower and upper end of each parameter, shape (P, 2): quantiles of the refits."""
        return np.asarray(np.nanquantile(self.values, [(1 - level) / 2, (1 + level) / 2], axis=0).T)

    def model(self, refit: int) -> Characteristic:
        """The law of one refit."""
        law: Characteristic = tree.unflatten(self.fit.problem.law, self.fit.problem.leaf_values(self.values[refit]))
        return law


def bootstrap(
    fit: Fit,
    recordings: Recording | Sequence[Recording],
    *,
    refits: int = 1000,
    by: GroupSplit | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Bootstrap:
    """Refit a law to parts of its data drawn with replacement (Efron and Tibshirani (1993), An Introduction to the
    Bootstrap, chapter 9).

    `recordings` are those that were fitted; `by` says what is drawn: RunSplit(), Levels(...) or SpecimenSplit(), without it
    the first of which there are three. Rows that are cut off take part as far as the fit itself contradicts them.
    Laws linear in their parameters are refitted all at once; others one by one from where the fit came to, and
    `progress` is called with the part done.
    Raises IdentificationError.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    which, count = _assign_groups(fit, runs, by or default_split(runs))
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), size=refits).astype(float)
    problem = fit.problem
    at_once = is_linear(problem) and isinstance(fit.loss, LeastSquares)
    values = (
        _refit_linear(problem, fit.values, which, drawn) if at_once else _refit_iteratively(fit, which, drawn, progress)
    )
    return Bootstrap(fit, values, count, seed)


def _assign_groups(fit: Fit, runs: Sequence[Recording], by: GroupSplit) -> tuple[RowIndices, int]:
    """The number of the part that each fitted row belongs to, and how many there are."""
    labels = np.concatenate(by.labels(runs))
    columns = [np.concatenate([run[name] for run in runs]) for name in ("pressure", "contraction", "force")]
    labels = labels[~np.isnan(np.stack(columns)).any(axis=0)]
    if labels.size != len(fit.recording):
        raise IdentificationError(
            f"the fit has {len(fit.recording)} rows and these recordings {labels.size}: give the ones that were fitted."
        )
    names, which = np.unique(labels, return_inverse=True)
    if names.size < 3:
        raise IdentificationError(
            f"only {names.size} {by.group_name}s to draw from: no scatter can be told. Give more runs, or draw by "
            "Levels('contraction')."
        )
    return which, int(names.size)


def _refit_linear(problem: FitProblem, values: Array, which: RowIndices, drawn: Array) -> Array:
    """All refits from the normal matrices of the parts: one product of (refits, parts) with (parts, P^2 + P)."""
    matrix, constant = design_matrix(problem)
    counting = problem.active_rows(matrix @ values + constant)
    scale = np.linalg.norm(matrix[counting], axis=0)
    # An orthonormal basis of the whole design keeps the normal matrices near the identity.
    weighted = problem.weights[counting, None] * (matrix[counting] / scale)
    triangle: Array = np.asarray(np.linalg.qr(weighted, mode="r"))
    rows = np.linalg.solve(triangle.T, weighted.T).T
    goal = problem.weights[counting] * (problem.target - constant)[counting]
    size = rows.shape[1]
    sums = np.zeros((drawn.shape[1], size * size + size))
    for part in range(drawn.shape[1]):
        here = rows[which[counting] == part]
        sums[part, : size * size] = (here.T @ here).ravel()
        sums[part, size * size :] = here.T @ goal[which[counting] == part]
    both = drawn @ sums
    normal, right = both[:, : size * size].reshape(-1, size, size), both[:, size * size :]
    determined = _has_full_rank(normal)
    found = np.full(right.shape, np.nan)
    found[determined] = np.linalg.solve(normal[determined], right[determined][..., None])[..., 0]
    return np.asarray(np.linalg.solve(triangle, found.T).T / scale)


def _has_full_rank(normal: Array) -> npt.NDArray[np.bool_]:
    """Which normal matrices have full rank; all at once where all have, which Cholesky's factors tell soonest."""
    with contextlib.suppress(np.linalg.LinAlgError):
        pivots = np.diagonal(np.linalg.cholesky(normal), axis1=1, axis2=2)
        if (pivots**2 > _MIN_EIGENVALUE).all():
            return np.ones(len(normal), dtype=bool)
    return np.asarray(np.linalg.eigvalsh(normal)[:, 0] > _MIN_EIGENVALUE)


def _refit_iteratively(
    fit: Fit, which: RowIndices, drawn: Array, progress: Callable[[float], None] | None = None
) -> Array:
    found = np.full((drawn.shape[0], len(fit.estimates)), np.nan)
    for i, counts in enumerate(drawn):
        if progress is not None:
            progress(i / len(drawn))
        times = counts[which]
        kept = times > 0
        problem = dataclasses.replace(
            fit.problem,
            data=fit.problem.data.rows(kept),
            target=fit.problem.target[kept],
            censoring=fit.problem.censoring[kept],
            weights=fit.problem.weights[kept] * np.sqrt(times[kept]),
        )
        try:
            found[i] = solve(problem, fit.loss, fit.values).values
        except (IdentificationError, np.linalg.LinAlgError):
            continue
    return found
