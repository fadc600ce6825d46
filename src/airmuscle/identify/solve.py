"""The two ways to the best parameters: at once where the law is linear in them, by iteration where it is not."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..declare import Leaf
from ..errors import IdentificationError
from .loss import Array, LeastSquares, Loss
from .problem import Problem

STEPS = 500
"""Iterations after which a fit gives up; none that was seen needed a fifth of them."""
_FINE = 1e-14


class Solution(NamedTuple):
    """The best free parameters, and there the law's answers and their derivatives."""

    values: Array
    modelled: Array
    slopes: Array


def solve(problem: Problem, loss: Loss) -> Solution:
    """The free parameters that make the loss least. Raises IdentificationError where the search fails."""
    return _solve_linear(problem, loss) if _is_linear(problem) else _solve_iterating(problem, loss)


def _is_linear(problem: Problem) -> bool:
    """Whether the law is linear in all that is to be found, and nothing bounds it."""
    field = getattr(problem.law, "linear_in", None)
    leaves: list[Leaf] = [problem.leaves[i] for i in problem.free]
    return field is not None and all(
        leaf.path.partition("[")[0] == field and leaf.declared.bounds == (-np.inf, np.inf) for leaf in leaves
    )


def _design(problem: Problem) -> tuple[Array, Array]:
    """Matrix (N, P) and constant part (N,) of a law linear in its free parameters."""
    basis = getattr(problem.law, "basis", None)
    if basis is not None and len(problem.free) == len(problem.law.terms):
        return np.array(basis(*problem.arguments)).T, np.zeros(len(problem.data))
    matrix = problem.slopes(problem.start)
    return matrix, problem.modelled(problem.start) - matrix @ problem.start


def _solve_linear(problem: Problem, loss: Loss) -> Solution:
    """Least squares at once; again, on the rows that count and with their weights, until neither changes.

    Each pass is a Newton step for squares on one side, or a reweighting for a robust loss; both sums are convex,
    so halving a step that does not help leads to the least one.
    """
    slopes, constant = _design(problem)
    norms = np.linalg.norm(slopes, axis=0)
    norms[norms == 0] = 1.0
    matrix = slopes / norms
    everyone = np.ones(len(problem.data), dtype=bool)
    goal, weights = problem.goal - constant, problem.weights
    found = _least_squares(matrix, goal, weights, everyone)
    plain = isinstance(loss, LeastSquares)
    if not (plain and not problem.sides.any()):
        found = _improved(problem, loss, matrix, constant, found, plain=plain)
    return Solution(found / norms, matrix @ found + constant, slopes)


def _least_squares(matrix: Array, goal: Array, weights: Array, rows: Any) -> Array:
    return np.asarray(np.linalg.lstsq(weights[rows, None] * matrix[rows], weights[rows] * goal[rows], rcond=1e-13)[0])


def _improved(problem: Problem, loss: Loss, matrix: Array, constant: Array, found: Array, *, plain: bool) -> Array:
    previous = None
    for _ in range(STEPS):
        modelled = matrix @ found + constant
        counting = problem.counting(modelled)
        if plain and previous is not None and np.array_equal(counting, previous):
            return found
        shares = np.sqrt(loss.rho((problem.errors(modelled) / loss.scale) ** 2)[1])
        aim = _least_squares(matrix, problem.goal - constant, problem.weights * shares, counting)
        stepped = _shortened(problem, loss, matrix, constant, found, aim)
        whole = stepped is aim
        if np.max(np.abs(stepped - found)) <= 1e-12 * np.max(np.abs(found), initial=1e-300):
            return stepped
        found, previous = stepped, counting if whole else None
    raise _no_end(problem)


def _shortened(problem: Problem, loss: Loss, matrix: Array, constant: Array, found: Array, aim: Array) -> Array:
    """The step to `aim`, halved until it does not make the loss greater; no step where rounding is all there is."""
    before = _total(problem, loss, matrix @ found + constant)
    for halving in range(30):
        tried = aim if halving == 0 else found + 0.5**halving * (aim - found)
        if _total(problem, loss, matrix @ tried + constant) <= before:
            return tried
    return found


def _total(problem: Problem, loss: Loss, modelled: Array) -> float:
    return float(loss.scale**2 * np.sum(loss.rho((problem.errors(modelled) / loss.scale) ** 2)[0]))


def _solve_iterating(problem: Problem, loss: Loss) -> Solution:
    """Bounded trust-region least squares, parameters and errors brought to the order of one."""
    from scipy.optimize import least_squares

    low, high = problem.bounds
    start = np.clip(problem.start, low, high)
    scale = np.where(start != 0, np.abs(start), np.where(np.isfinite(high - low), high - low, 1.0))
    spread = float(np.ptp(problem.goal)) or float(np.max(np.abs(problem.goal))) or 1.0
    _refuse_non_finite(problem, start)

    def errors(scaled: Array) -> Array:
        return problem.errors(problem.modelled(scaled * scale)) / spread

    def slopes(scaled: Array) -> Array:
        values = scaled * scale
        counting = problem.counting(problem.modelled(values))
        return np.asarray(problem.slopes(values) * (counting * problem.weights / spread)[:, None] * scale)

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
