"""The two ways to the best parameters: at once where the law is linear in them, by iteration where it is not."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from ..declare import Leaf
from ..errors import IdentificationError
from .loss import Array, LeastSquares, Loss
from .problem import Problem

STEPS = 500
"""Iterations after which a fit gives up; none that was seen needed a fifth of them."""
_FINE = 1e-14
_NARROWING = 4.0
"""Part by which the scale of a robust loss goes down from search to search (chosen)."""
RANK_TOLERANCE = 1e-10
"""Singular values of the scaled design below this part of the greatest count as zero (chosen): a parameter that
ten digits of the data do not determine is not determined."""
_PASSES = 200
"""Most Newton steps of a linear fit with rows that are cut off; it ends by itself, and none that was seen took 30."""
_SLIGHT = 1e-4
"""Weight of a row that is cut off and not contradicted, where nothing else decides (chosen)."""


class Solution(NamedTuple):
    """The best free parameters, and there the law's answers and their derivatives."""

    values: Array
    modelled: Array
    slopes: Array


def solve(problem: Problem, loss: Loss) -> Solution:
    """The free parameters that make the loss least. Raises IdentificationError where the search fails."""
    if not is_linear(problem):
        return _solve_iterating(problem, loss, problem.start)
    found = _solve_linear(problem)
    if isinstance(loss, LeastSquares):
        return found
    robust = _solve_narrowing(problem, loss, found)
    if _measured_alone_determine(problem, robust.slopes):
        return robust
    # The search stops as soon as no bound is contradicted, and no row speaks any more for what bounds alone determine.
    return _solve_linear(_reweighted(problem, loss, robust))


def _solve_narrowing(problem: Problem, loss: Loss, start: Solution) -> Solution:
    """From the scale of the errors down to the one wanted: searches under a loss far narrower do not settle."""
    values = start.values
    scale = float(np.sqrt(np.mean(problem.errors(start.modelled) ** 2)))
    while scale > _NARROWING * loss.scale:
        values = _solve_iterating(problem, loss.with_scale(scale), values).values
        scale /= _NARROWING
    return _solve_iterating(problem, loss, values)


def _reweighted(problem: Problem, loss: Loss, solution: Solution) -> Problem:
    """The problem of which a robust solution is the least-squares one: every square weighted by rho' there."""
    slope = loss.rho((problem.errors(solution.modelled) / loss.scale) ** 2)[1]
    return dataclasses.replace(problem, weights=problem.weights * np.sqrt(slope))


def _measured_alone_determine(problem: Problem, slopes: Array) -> bool:
    return bool((problem.sides == 0).all()) or measured_rank(problem, slopes) == slopes.shape[1]


def is_linear(problem: Problem) -> bool:
    """Whether the law is linear in all that is to be found, and nothing bounds it."""
    named = getattr(problem.law, "linear_in", ())
    fields = (named,) if isinstance(named, str) else named
    leaves: list[Leaf] = [problem.leaves[i] for i in problem.free]
    return bool(fields) and all(
        leaf.path.partition("[")[0] in fields and leaf.declared.bounds == (-np.inf, np.inf) for leaf in leaves
    )


def design(problem: Problem) -> tuple[Array, Array]:
    """Matrix (N, P) and constant part (N,) of a law linear in its free parameters."""
    basis = getattr(problem.law, "basis", None)
    if basis is not None and len(problem.free) == len(problem.law.terms):
        return np.array(basis(*problem.arguments)).T, np.zeros(len(problem.data))
    matrix = problem.slopes(problem.start)
    return matrix, problem.modelled(problem.start) - matrix @ problem.start


def _solve_linear(problem: Problem) -> Solution:
    """Least squares at once, or again on the rows that count until these are the same.

    Squares on one side of a bound make a convex sum, of which each pass is a Newton step, halved where the whole of it
    goes too far. Where the measured rows alone leave parameters open, a law may fall below its bounds without end; of
    all that are equally good, the one nearest to the bounds is taken.
    """
    slopes, constant = design(problem)
    norms = np.linalg.norm(slopes, axis=0)
    norms[norms == 0] = 1.0
    matrix = problem.weights[:, None] * (slopes / norms)
    goal = problem.weights * (problem.goal - constant)
    uncounted = 0.0 if _measured_alone_determine(problem, slopes) else _SLIGHT

    def shares(scaled: Array) -> Array:
        return np.where(problem.counting(slopes @ (scaled / norms) + constant), 1.0, uncounted)

    def squares(scaled: Array) -> float:
        return float(np.sum((shares(scaled) * (matrix @ scaled - goal)) ** 2))

    share, found = np.ones(len(goal)), np.zeros(len(norms))
    for passes in range(_PASSES):
        step = np.linalg.lstsq(share[:, None] * matrix, share * goal, rcond=1e-13)[0] - found
        if passes:
            least = squares(found)
            step = next((t * step for t in 0.5 ** np.arange(30) if squares(found + t * step) <= least), 0.0 * step)
        found, previous = found + step, share
        share = shares(found)
        if np.array_equal(share, previous):
            break
    values = found / norms
    return Solution(values, slopes @ values + constant, slopes)


def measured_rank(problem: Problem, slopes: Array) -> int:
    """How many parameters the rows that are not cut off determine by themselves."""
    matrix = (problem.weights[:, None] * slopes)[problem.sides == 0]
    norms = np.linalg.norm(matrix, axis=0)
    return int(np.linalg.matrix_rank(matrix / np.where(norms > 0, norms, 1.0), rtol=RANK_TOLERANCE))


def _solve_iterating(problem: Problem, loss: Loss, start: Array) -> Solution:
    """Bounded trust-region least squares, parameters and errors brought to the order of one."""
    from scipy.optimize import least_squares

    low, high = problem.bounds
    start = np.clip(start, low, high)
    scale = np.where(start != 0, np.abs(start), np.where(np.isfinite(high - low), high - low, 1.0))
    spread = float(np.ptp(problem.goal)) or float(np.max(np.abs(problem.goal))) or 1.0
    _refuse_non_finite(problem, start)

    def errors(scaled: Array) -> Array:
        return problem.errors(problem.modelled(scaled * scale)) / spread

    def slopes(scaled: Array) -> Array:
        values = scaled * scale
        counting = problem.counting(problem.modelled(values))
        return np.asarray(problem.slopes(values) * (counting * problem.weights / spread)[:, None] * scale)

    if np.abs(errors(start / scale)).max() < 1e-14:  # it meets every row already: there is no slope to follow
        return Solution(start, problem.modelled(start), problem.slopes(start))
    result = least_squares(
        errors,
        start / scale,
        jac=slopes,
        bounds=(low / scale, high / scale),
        x_scale="jac",
        loss="linear" if isinstance(loss, LeastSquares) else loss.rho,
        f_scale=loss.scale / spread,
        ftol=_FINE,
        xtol=_FINE,
        gtol=None,
        max_nfev=STEPS,
    )
    if result.status <= 0:
        raise _no_end(problem)
    values = np.clip(result.x * scale, low, high)
    return Solution(values, problem.modelled(values), problem.slopes(values))


def _refuse_non_finite(problem: Problem, start: Array) -> None:
    values = problem.modelled(start)
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        (first, second), (a, b) = problem.direction.arguments, (x[row] for x in problem.arguments)
        raise IdentificationError(
            f"{problem.data.origin}: with its start values {type(problem.law).__name__} gives no finite "
            f"{problem.direction.quantity} at {np.count_nonzero(bad)} of {len(values)} points, the first at {first} "
            f"{a:.6g} and {second} {b:.6g} (SI). Start from other values, or leave out points beyond the law's reach."
        )


def _no_end(problem: Problem) -> IdentificationError:
    return IdentificationError(
        f"{problem.data.origin}: the fit of {type(problem.law).__name__} did not settle in {STEPS} steps. Start from "
        "values nearer to the muscle, hold some parameters with fixed=, or choose a law with fewer."
    )
