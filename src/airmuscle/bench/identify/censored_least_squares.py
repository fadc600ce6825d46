"""Censored least squares of a law that is linear in its parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.arrays import Array
from .problem import FitProblem

RANK_TOLERANCE = 1e-10
"""Relative tolerance below which a singular value of the scaled design matrix counts as zero (chosen): a parameter
that is not determined within ten digits of the data is not determined."""
_INACTIVE_WEIGHT = 1e-4
"""Weight of an inactive censored row, where the uncensored rows alone do not determine all parameters (chosen)."""
_MAX_ITERATIONS = 200
"""Maximum number of Newton steps with censored rows; the iteration is finite and took fewer than 30 in all tests."""
_RCOND = 1e-13


def solve_censored_least_squares(problem: FitProblem, jacobian: Array, constant: Array) -> Array:
    """The parameters x that minimise the weighted residuals of `jacobian` (N, P) @ x + `constant` (N,).

    A censored row contributes only where the law violates its bound. The one-sided squares form a convex sum; each
    iteration is a Newton step, halved until the sum does not increase. Where the uncensored rows alone do not determine
    all parameters, the minimum is not unique: of all equally good solutions the one closest to the bounds is returned.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0] = 1.0
    matrix = problem.weights[:, None] * (jacobian / norms)
    target = problem.weights * (problem.target - constant)
    if not problem.censoring.any():
        return np.asarray(np.linalg.lstsq(matrix, target, rcond=_RCOND)[0] / norms)
    inactive = 0.0 if is_determined_without_censored(problem, jacobian) else _INACTIVE_WEIGHT

    def row_weights(scaled: Array) -> Array:
        return np.where(problem.active_rows(jacobian @ (scaled / norms) + constant), 1.0, inactive)

    def sum_of_squares(scaled: Array) -> float:
        return float(np.sum((row_weights(scaled) * (matrix @ scaled - target)) ** 2))

    weights, x = np.ones(len(target)), np.zeros(len(norms))
    for iteration in range(_MAX_ITERATIONS):
        counted = slice(None) if weights.all() else weights > 0
        rows, right = weights[counted, None] * matrix[counted], weights[counted] * target[counted]
        step = np.linalg.lstsq(rows, right, rcond=_RCOND)[0] - x
        if iteration:
            current = sum_of_squares(x)
            step = shortened_step(sum_of_squares, x, step, current)
        x, previous = x + step, weights
        weights = row_weights(x)
        if np.array_equal(weights, previous):
            break
    return np.asarray(x / norms)


def shortened_step(
    sum_of_squares: Callable[[Array], float], x: Array, step: Array, limit: float, halvings: int = 30
) -> Array:
    """The step from x, halved until the sum of squares is at most `limit`; zero where no part of it is short enough."""
    parts = (factor * step for factor in 0.5 ** np.arange(halvings))
    return next((part for part in parts if sum_of_squares(x + part) <= limit), 0.0 * step)


def is_determined_without_censored(problem: FitProblem, jacobian: Array) -> bool:
    """Whether the uncensored rows alone determine all parameters."""
    return not problem.censoring.any() or uncensored_rank(problem, jacobian) == jacobian.shape[1]


def uncensored_rank(problem: FitProblem, jacobian: Array) -> int:
    """Rank of the weighted design matrix of the uncensored rows."""
    matrix = (problem.weights[:, None] * jacobian)[problem.censoring == 0]
    norms = np.linalg.norm(matrix, axis=0)
    triangle = np.linalg.qr(matrix / np.where(norms > 0, norms, 1.0), mode="r")  # with the same singular values
    return int(np.linalg.matrix_rank(triangle, rtol=RANK_TOLERANCE))
