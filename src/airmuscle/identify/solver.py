"""The two ways to the best parameters: at once where the law is linear in them, by iteration where it is not."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.errors import IdentificationError
from ..core.tree import Leaf
from .censored_least_squares import is_determined_without_censored, solve_censored_least_squares
from .loss import LeastSquares, Loss
from .problem import FitProblem
from .variable_projection import find_initial_values, is_linear_parameter

SEARCH_STAGES = (("trf", 100), ("dogbox", 500), ("trf", 500))
"""Methods of a fit, each after its iterations where the one before did not settle; the last gives up (chosen).

The first creeps along a bound, which the second steps onto; where it does not creep, none that was seen needed 100."""
_TOLERANCE = 1e-14
_RELATIVE_OFFSET = 1e-3
"""Relative offset at which parameters count as found, that of Bates and Watts."""
_SINGULAR_TOLERANCE = 1e-8
"""Singular values below this part of the greatest tell of parameters that replace each other (chosen)."""


class Solution(NamedTuple):
    """The best free parameters, and there the law's answers and their derivatives."""

    values: Array
    modelled: Array
    jacobian: Array


def solve(problem: FitProblem, loss: Loss, start: Array | None = None) -> Solution:
    """The free parameters that make the loss least. Raises IdentificationError where the search fails.

    It begins at `start`, which a refit knows; without it, at the best of several places where the law allows that.
    """
    if not is_linear(problem):
        return _solve_iteratively(problem, loss, find_initial_values(problem) if start is None else start)
    found = _solve_linear(problem)
    if isinstance(loss, LeastSquares):
        return found
    robust = _solve_iteratively(problem, loss, found.values)
    if is_determined_without_censored(problem, robust.jacobian):
        return robust
    # The search stops as soon as no bound is contradicted, and no row speaks any more for what bounds alone determine.
    return _solve_linear(_reweight(problem, loss, robust))


def _reweight(problem: FitProblem, loss: Loss, solution: Solution) -> FitProblem:
    """The problem of which a robust solution is the least-squares one: every square weighted by rho' there."""
    slope = loss.rho((problem.residuals(solution.modelled) / loss.scale) ** 2)[1]
    return dataclasses.replace(problem, weights=problem.weights * np.sqrt(slope))


def is_linear(problem: FitProblem) -> bool:
    """Whether the law is linear in all that is to be found, and nothing bounds it."""
    leaves: list[Leaf] = [problem.leaves[i] for i in problem.free]
    unbounded = all(leaf.declared.bounds == (-np.inf, np.inf) for leaf in leaves)
    return unbounded and bool(is_linear_parameter(problem).all())


def design_matrix(problem: FitProblem) -> tuple[Array, Array]:
    """Matrix (N, P) and constant part (N,) of a law linear in its free parameters."""
    basis = getattr(problem.law, "basis", None)
    if basis is not None and len(problem.free) == len(problem.law.terms):
        return np.array(basis(*problem.arguments)).T, np.zeros(len(problem.data))
    matrix = problem.jacobian(problem.initial_values)
    return matrix, problem.predict(problem.initial_values) - matrix @ problem.initial_values


def _solve_linear(problem: FitProblem) -> Solution:
    slopes, constant = design_matrix(problem)
    values = solve_censored_least_squares(problem, slopes, constant)
    return Solution(values, slopes @ values + constant, slopes)


def _solve_iteratively(problem: FitProblem, loss: Loss, start: Array) -> Solution:
    """Bounded trust-region least squares, parameters and errors brought to the order of one."""
    from scipy.optimize import least_squares

    low, high = problem.bounds
    start = np.clip(start, low, high)
    scale = np.where(start != 0, np.abs(start), np.where(np.isfinite(high - low), high - low, 1.0))
    spread = float(np.ptp(problem.target)) or float(np.max(np.abs(problem.target))) or 1.0
    _check_finite(problem, start)

    def errors(scaled: Array) -> Array:
        return problem.residuals(problem.predict(scaled * scale)) / spread

    def slopes(scaled: Array) -> Array:
        values = scaled * scale
        counting = problem.active_rows(problem.predict(values))
        return np.asarray(problem.jacobian(values) * (counting * problem.weights / spread)[:, None] * scale)

    if np.abs(errors(start / scale)).max() < 1e-14:  # it meets every row already: there is no slope to follow
        return Solution(start, problem.predict(start), problem.jacobian(start))
    options: dict[str, Any] = {
        "jac": slopes,
        "bounds": (low / scale, high / scale),
        "x_scale": "jac",
        "loss": "linear" if isinstance(loss, LeastSquares) else loss.rho,
        "f_scale": loss.scale / spread,
        "ftol": _TOLERANCE,
        "xtol": _TOLERANCE,
        "gtol": None,
    }
    scaled = start / scale
    for method, most in SEARCH_STAGES:
        result = least_squares(errors, scaled, method=method, max_nfev=most, **options)
        scaled = result.x
        if result.status > 0 or _is_converged(result):
            break
    else:
        raise _not_converged(problem)
    values = np.clip(scaled * scale, low, high)
    return Solution(values, problem.predict(values), problem.jacobian(values))


def _is_converged(result: Any) -> bool:
    """Whether hardly anything of the errors lies along the slopes, though a search creeps on.

    Where parameters replace each other it does so for ever. The relative offset of Bates and Watts, Technometrics
    23:179 (1981), says that there is nothing left to find.
    """
    norms = np.linalg.norm(result.jac, axis=0)
    norms[norms == 0] = 1.0
    along = np.linalg.lstsq((result.jac / norms).T, result.grad / norms, rcond=_SINGULAR_TOLERANCE)[0]
    squares, size = float(along @ along), norms.size
    spare = max(result.fun.size - size, 1)
    return bool(squares / size <= _RELATIVE_OFFSET**2 * (2 * result.cost - squares) / spare)


def _check_finite(problem: FitProblem, start: Array) -> None:
    values = problem.predict(start)
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        (first, second), (a, b) = problem.fitted_quantity.arguments, (x[row] for x in problem.arguments)
        raise IdentificationError(
            f"{problem.data.origin}: with its start values {type(problem.law).__name__} gives no finite "
            f"{problem.fitted_quantity.name} at {np.count_nonzero(bad)} of {len(values)} points, the first at {first} "
            f"{a:.6g} and {second} {b:.6g} (SI). Start from other values, or leave out points beyond the law's reach."
        )


def _not_converged(problem: FitProblem) -> IdentificationError:
    steps = sum(most for _, most in SEARCH_STAGES)
    return IdentificationError(
        f"{problem.data.origin}: the fit of {type(problem.law).__name__} did not settle in {steps} steps. Start from "
        "values nearer to the muscle, hold some parameters with fixed=, or choose a law with fewer."
    )
