"""Bootstrap of a fit: refits to resampled groups of rows (runs, levels or specimens)."""

import contextlib
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array, Hint, IdentificationError, check_whole
from ...engine.distribution import DistributedCalls, stored_result
from ...engine.processes import Workers, check_running, process_pool
from ...recording import Recording
from ..estimation import (
    GroupRefits,
    GroupSplit,
    KnownMinima,
    LeastSquares,
    LevelSplit,
    RowIndices,
    default_split,
    solve_iteratively,
    solve_least_squares,
)
from .fit_points import FitPoints
from .fit_problem import FitProblem
from .static_fit_result import Fit
from .uncertainty import MIN_GROUPS, RELIABLE_GROUPS, Bootstrap

REFITS_OF_A_TASK = 100
"""Refits of a law that is not linear in its parameters, that are computed one after the other
(chosen).
"""
_MIN_EIGENVALUE = 1e-10
"""Minimum eigenvalue of the normal matrix of a refit, in the basis in which that of all rows is 1
(chosen).
"""


def bootstrap(
    fit: Fit,
    recordings: Recording | Sequence[Recording],
    *,
    refits: int = 1000,
    by: GroupSplit | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    workers: Workers = 1,
) -> Bootstrap:
    """Refit a law to groups of its data drawn with replacement (Efron and Tibshirani (1993), An
    Introduction to the Bootstrap, chapter 9).

    recordings  those that were fitted
    by          the groups: RunSplit(), LevelSplit(...) or SpecimenSplit(); by default the first of
                these that has at least `MIN_GROUPS` groups
    progress    called with the completed fraction
    workers     number of processes, as in `compare`; the result does not depend on it

    Censored rows are active where the original fit violates their bound. A law that is linear in
    its parameters is refitted by one matrix product; any other law is refitted iteratively from the
    parameters of the original fit, or from those of an earlier refit with a smaller sum of squares
    in this sample, one of the first `REFITS_OF_A_TASK` or of its own block of as many. Raises
    IdentificationError.
    """
    check_whole("bootstrap", "refits", refits, 1)
    check_whole("bootstrap", "seed", seed, 0)
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    by = by or default_split(runs, MIN_GROUPS)
    labels = np.concatenate(by.labels(runs))[~FitPoints.from_recordings(runs).missing]
    if labels.size != len(fit.recording):
        raise IdentificationError(
            f"the fit has {len(fit.recording)} rows, but the recordings have {labels.size}. Give"
            " the recordings that were fitted."
        )
    names, group = np.unique(labels, return_inverse=True)
    count = int(names.size)
    if count < MIN_GROUPS:
        raise IdentificationError(
            f"a bootstrap needs {MIN_GROUPS} {by.group_name}s or more, but the data have {count},"
            f" whose few different samples do not give an interval; {RELIABLE_GROUPS} or more are"
            " recommended. Give more runs, or use the standard errors of the fit.",
            hint=Hint("To resample by levels of contraction", "by", LevelSplit("contraction")),
        )
    draws = (
        np.random.default_rng(seed)
        .multinomial(count, np.full(count, 1.0 / count), size=refits)
        .astype(float)
    )
    if fit.problem.is_linear and isinstance(fit.loss, LeastSquares):
        return Bootstrap(fit, _refit_linear(fit.problem, fit.values, group, draws), count, seed)
    report = progress or (lambda fraction: None)
    blocks = [draws[i : i + REFITS_OF_A_TASK] for i in range(0, refits, REFITS_OF_A_TASK)]
    none = np.empty((0, len(fit.estimates)))
    first = stored_result(
        f"{__name__}:first refits",
        (fit, group, blocks[0]),
        lambda: _refit_iteratively((fit, group, none, report), blocks[0]),
    )
    # The other blocks, at once, start at the parameters found in the first.
    with process_pool(
        workers if len(blocks) > 2 else 1, one_thread_each=True, terminate=True
    ) as executor:
        distribution = DistributedCalls(executor, _refit_iteratively, (fit, group, first, None))
        others = distribution.results(blocks[1:], lambda number: report((1 + number) / len(blocks)))
    return Bootstrap(fit, np.concatenate([first, *others]), count, seed)


def _refit_linear(problem: FitProblem, values: Array, group: RowIndices, draws: Array) -> Array:
    """All refits from the normal matrices of the groups: one product of (refits, groups) with
    (groups, P^2 + P).
    """
    matrix, constant = problem.design_matrix()
    active = problem.active_rows(matrix @ values + constant)
    scale = np.linalg.norm(matrix[active], axis=0)
    # An orthonormal basis of the complete design matrix keeps the normal matrices near the
    # identity.
    weighted = problem.weights[active, None] * (matrix[active] / scale)
    triangle: Array = np.asarray(np.linalg.qr(weighted, mode="r"))
    rows = np.linalg.solve(triangle.T, weighted.T).T
    target = problem.weights[active] * (problem.target - constant)[active]
    size = rows.shape[1]
    sums = np.zeros((draws.shape[1], size * size + size))
    for i in range(draws.shape[1]):
        own = group[active] == i
        block = rows[own]
        sums[i] = np.append(block.T @ block, block.T @ target[own])
    totals = draws @ sums
    normal = totals[:, : size * size].reshape(-1, size, size)
    right = totals[:, size * size :]
    determined = _has_full_rank(normal)
    solutions = np.full(right.shape, np.nan)
    solutions[determined] = np.linalg.solve(normal[determined], right[determined][..., None])[
        ..., 0
    ]
    return np.asarray(np.linalg.solve(triangle, solutions.T).T / scale)


def _has_full_rank(normal: Array) -> npt.NDArray[np.bool_]:
    """Mask of the normal matrices of full rank; the Cholesky factors are the fast test for the case
    that all are.
    """
    with contextlib.suppress(np.linalg.LinAlgError):
        pivots = np.diagonal(np.linalg.cholesky(normal), axis1=1, axis2=2)
        if (pivots**2 > _MIN_EIGENVALUE).all():
            return np.ones(len(normal), dtype=bool)
    return np.asarray(np.linalg.eigvalsh(normal)[:, 0] > _MIN_EIGENVALUE)


def _refit_iteratively(
    common: tuple[Fit, RowIndices, Array, Callable[[float], None] | None], draws: Array
) -> Array:
    """Refits one by one, each started at the best of the parameters found before: the fit's own,
    given ones, and those of this block."""
    fit, group, known_values, progress = common
    values = np.full((draws.shape[0], len(fit.estimates)), np.nan)
    problem = fit.problem
    count = draws.shape[1]
    near = None
    known = KnownMinima(problem, fit.values, group, count)
    for found in known_values[np.isfinite(known_values).all(axis=1)]:
        known.add(found)
    if isinstance(fit.loss, LeastSquares) and not problem.is_linear:
        near = GroupRefits(problem, problem.solution(fit.values), group, count)
    for i, counts in enumerate(draws):
        if progress is not None:
            progress(0.1 * i / len(draws))
        check_running()
        refitted = None if near is None else near.refit(counts, known.best(counts))
        if (
            refitted is None
        ):  # a search of its own; Gauss-Newton steps have failed where there are `near` refits
            search = solve_least_squares if near is None else solve_iteratively
            with contextlib.suppress(IdentificationError, np.linalg.LinAlgError):
                refitted = search(problem.repeated(counts[group]), fit.loss, fit.values).values
        if refitted is not None and np.isfinite(refitted).all():
            values[i] = refitted
            known.add(refitted)
    return values
