"""Least squares of a law linear in its parameters, where rows that were cut off count on one side only."""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array
from .problem import FitProblem

RANK_TOLERANCE = 1e-10
"""Singular values of the scaled design below this part of the greatest count as zero (chosen): a parameter that
ten digits of the data do not determine is not determined."""
_INACTIVE_WEIGHT = 1e-4
"""Weight of a row that is cut off and not contradicted, where nothing else decides (chosen)."""
_MAX_ITERATIONS = 200
"""Most Newton steps with rows that are cut off; they end by themselves, and none that were seen took 30."""
_RCOND = 1e-13


def solve_censored_least_squares(problem: FitProblem, slopes: Array, constant: Array) -> Array:
    """The x for which `slopes` (N, P) @ x + `constant` (N,) meets the goal best: at once, or on the rows that count.

    Squares on one side of a bound make a convex sum, of which each pass is a Newton step, halved where the whole of it
    goes too far. Where the measured rows alone leave parameters open, a law may fall below its bounds without end; of
    all that are equally good, the one nearest to the bounds is taken.
    """
    norms = np.linalg.norm(slopes, axis=0)
    norms[norms == 0] = 1.0
    matrix = problem.weights[:, None] * (slopes / norms)
    goal = problem.weights * (problem.target - constant)
    if not problem.censoring.any():
        return np.asarray(np.linalg.lstsq(matrix, goal, rcond=_RCOND)[0] / norms)
    uncounted = 0.0 if is_determined_without_censored(problem, slopes) else _INACTIVE_WEIGHT

    def shares(scaled: Array) -> Array:
        return np.where(problem.active_rows(slopes @ (scaled / norms) + constant), 1.0, uncounted)

    def squares(scaled: Array) -> float:
        return float(np.sum((shares(scaled) * (matrix @ scaled - goal)) ** 2))

    share, found = np.ones(len(goal)), np.zeros(len(norms))
    for passes in range(_MAX_ITERATIONS):
        step = np.linalg.lstsq(share[:, None] * matrix, share * goal, rcond=_RCOND)[0] - found
        if passes:
            least = squares(found)
            step = next((t * step for t in 0.5 ** np.arange(30) if squares(found + t * step) <= least), 0.0 * step)
        found, previous = found + step, share
        share = shares(found)
        if np.array_equal(share, previous):
            break
    return np.asarray(found / norms)


def is_determined_without_censored(problem: FitProblem, slopes: Array) -> bool:
    """Whether all parameters are determined without the rows that are cut off."""
    return not problem.censoring.any() or uncensored_rank(problem, slopes) == slopes.shape[1]


def uncensored_rank(problem: FitProblem, slopes: Array) -> int:
    """How many parameters the rows that are not cut off determine by themselves."""
    matrix = (problem.weights[:, None] * slopes)[problem.censoring == 0]
    norms = np.linalg.norm(matrix, axis=0)
    return int(np.linalg.matrix_rank(matrix / np.where(norms > 0, norms, 1.0), rtol=RANK_TOLERANCE))
