"""Refits of a least-squares problem to groups of its rows that are drawn with replacement."""

import contextlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, IdentificationError
from ...engine.distribution import DistributedCalls, stored_result
from ...engine.processes import Workers, check_running, process_pool
from .group_refits import GroupRefits, KnownMinima, RowIndices
from .problem import LeastSquaresProblem
from .solver import solve_iteratively, solve_least_squares
from .weighting import LeastSquares, Loss

REFITS_OF_A_TASK = 100
"""Refits of a law that is not linear in its parameters, that are computed one after the other
(chosen).
"""
_MIN_EIGENVALUE = 1e-10
"""Minimum eigenvalue of the normal matrix of a refit, in the basis in which that of all rows is 1
(chosen).
"""


class Refitted(NamedTuple):
    """What is refitted: the problem, its solution (P,), the loss, and the group (N,) of each
    row.
    """

    problem: LeastSquaresProblem
    values: Array
    loss: Loss
    group: RowIndices


def resampled_values(
    problem: LeastSquaresProblem,
    values: Array,
    loss: Loss,
    group: RowIndices,
    draws: Array,
    *,
    progress: Callable[[float], None] | None = None,
    workers: Workers = 1,
) -> Array:
    """The parameters (R, P) of refits to these multiplicities (R, G) of the groups; NaN where the
    drawn groups do not determine them. A problem that is linear in its parameters is refitted by
    one matrix product; any other iteratively from the solution `values` (P,), or from that of an
    earlier refit with a smaller sum of squares in this sample, one of the first `REFITS_OF_A_TASK`
    or of its own block of as many."""
    if problem.is_linear and isinstance(loss, LeastSquares):
        return _refit_linear(problem, values, group, draws)
    fitted = Refitted(problem, values, loss, group)
    report = progress or (lambda fraction: None)
    count = len(draws)
    blocks = [draws[i : i + REFITS_OF_A_TASK] for i in range(0, count, REFITS_OF_A_TASK)]
    none = np.empty((0, values.size))
    first = stored_result(
        f"{__name__}:first refits",
        (fitted, blocks[0]),
        lambda: _refit_iteratively((fitted, none, report), blocks[0]),
    )
    # The other blocks, at once, start at the parameters found in the first.
    with process_pool(
        workers if len(blocks) > 2 else 1, one_thread_each=True, terminate=True
    ) as executor:
        distribution = DistributedCalls(executor, _refit_iteratively, (fitted, first, None))
        others = distribution.results(blocks[1:], lambda number: report((1 + number) / len(blocks)))
    return np.concatenate([first, *others])


def _refit_linear(
    problem: LeastSquaresProblem, values: Array, group: RowIndices, draws: Array
) -> Array:
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
    common: tuple[Refitted, Array, Callable[[float], None] | None], draws: Array
) -> Array:
    """Refits one by one, each started at the best of the parameters found before: the fit's own,
    given ones, and those of this block."""
    fitted, known_values, progress = common
    problem, fit_values, loss, group = fitted
    values = np.full((draws.shape[0], fit_values.size), np.nan)
    count = draws.shape[1]
    near = None
    known = KnownMinima(problem, fit_values, group, count)
    for found in known_values[np.isfinite(known_values).all(axis=1)]:
        known.add(found)
    if isinstance(loss, LeastSquares) and not problem.is_linear:
        near = GroupRefits(problem, problem.solution(fit_values), group, count)
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
                refitted = search(problem.repeated(counts[group]), loss, fit_values).values
        if refitted is not None and np.isfinite(refitted).all():
            values[i] = refitted
            known.add(refitted)
    return values
