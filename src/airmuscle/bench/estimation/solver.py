"""Least-squares solvers: direct for laws linear in their parameters, iterative otherwise."""

import numpy as np

from ...core import Array, Hint, IdentificationError
from .evaluations import ProblemSearch
from .least_squares_descent import gauss_newton
from .problem import LeastSquaresProblem, LeastSquaresSolution
from .search import is_budget_spent
from .variable_projection import (
    find_initial_values,
    solve_censored_least_squares,
    uncensored_rank,
)
from .weighting import LeastSquares, Loss

MAX_EVALUATIONS = 1000
"""Maximum evaluations of a search (chosen: along a valley of redundant parameters it makes small
steps)."""


def solve_least_squares(
    problem: LeastSquaresProblem, loss: Loss, start: Array | None = None
) -> LeastSquaresSolution:
    """The free parameters that minimise the loss. Raises IdentificationError where the search does
    not converge. The search starts at `start`, if possible by Gauss-Newton steps; by default at the
    initial values found by variable projection."""
    if not problem.is_linear:
        near = (
            gauss_newton(problem, start)
            if start is not None and isinstance(loss, LeastSquares)
            else None
        )
        if near is not None:
            return near
        return solve_iteratively(
            problem, loss, find_initial_values(problem) if start is None else start
        )
    linear = _solve_linear(problem)
    if isinstance(loss, LeastSquares):
        return linear
    robust = solve_iteratively(problem, loss, linear.values)
    if (
        not problem.censoring.any()
        or uncensored_rank(problem, robust.jacobian) == robust.values.size
    ):
        return robust
    # The search stops as soon as no bound is violated; parameters that only bounds determine are
    # then arbitrary. Least squares with every square weighted by rho' have the same solution.
    derivative = loss.rho((problem.residuals(robust.modelled) / loss.scale) ** 2)[1]
    return _solve_linear(problem.weighted(np.sqrt(derivative)))


def _solve_linear(problem: LeastSquaresProblem) -> LeastSquaresSolution:
    matrix, constant = problem.design_matrix()
    values = solve_censored_least_squares(problem, matrix, constant)
    return LeastSquaresSolution(values, matrix @ values + constant, matrix)


def solve_iteratively(
    problem: LeastSquaresProblem, loss: Loss, start: Array, max_evaluations: int = MAX_EVALUATIONS
) -> LeastSquaresSolution:
    """The solution of the search from an initial guess (P,). Raises IdentificationError where the
    fitted quantity is not finite there, or the search does not converge."""
    search = ProblemSearch(problem, loss, start).check_start().run(max_evaluations)
    if not search.is_finished and not is_budget_spent():
        raise IdentificationError(
            f"{problem.origin}: the fit of {problem.name} did not converge in {max_evaluations}"
            " evaluations. Give initial values closer to those of the muscle, or"
            " choose a law with fewer parameters.",
            hint=Hint("To fix parameters", "fixed"),
            cause="the fit does not converge",
        )
    return problem.solution(search.values)
