"""Least-squares solvers: direct for laws linear in their parameters, iterative otherwise."""

from typing import Any

import numpy as np

from ...core import Array, Hint, IdentificationError
from .least_squares_descent import gauss_newton
from .problem import LeastSquaresProblem, LeastSquaresSolution
from .search import is_budget_spent
from .trust_region import search_trust_region
from .variable_projection import (
    find_initial_values,
    solve_censored_least_squares,
    uncensored_rank,
)
from .weighting import LeastSquares, Loss

SEARCH_STAGES = (("trf", 100), ("dogbox", 500), ("trf", 500))
"""Methods and maximum evaluations; each starts where the previous one stopped without convergence
(chosen).

`trf` converges slowly along an active bound, which `dogbox` steps onto; in all other tests it
needed fewer than 100."""
_TOLERANCE = 1e-14
_RELATIVE_OFFSET = 1e-3
"""Relative offset of Bates and Watts at which the search counts as converged."""
_SINGULAR_TOLERANCE = 1e-8
"""Relative singular value below which parameters count as redundant (chosen)."""


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
    problem: LeastSquaresProblem, loss: Loss, start: Array
) -> LeastSquaresSolution:
    """Trust-region least squares within bounds, with parameters and residuals scaled to the order
    of one.
    """
    low, high = problem.bounds
    start = np.clip(start, low, high)
    scale = np.where(start != 0, np.abs(start), np.where(np.isfinite(high - low), high - low, 1.0))
    spread = float(np.ptp(problem.target)) or float(np.max(np.abs(problem.target))) or 1.0
    _check_finite(problem, start)

    def residuals(scaled: Array) -> Array:
        return problem.residuals(problem.predict(scaled * scale)) / spread

    def jacobian(scaled: Array) -> Array:
        values = scaled * scale
        active = problem.active_rows(problem.predict(values))
        return np.asarray(
            problem.jacobian(values) * (active * problem.weights / spread)[:, None] * scale
        )

    if np.abs(residuals(start / scale)).max() < 1e-14:  # an exact fit: the gradient vanishes
        return problem.solution(start)
    rho = "linear" if isinstance(loss, LeastSquares) else loss.rho
    tolerances = {"ftol": _TOLERANCE, "xtol": _TOLERANCE, "gtol": None}
    options: dict[str, Any] = {
        "x_scale": "jac",
        "loss": rho,
        "f_scale": loss.scale / spread,
        **tolerances,
    }
    scaled = start / scale
    bounds = (low / scale, high / scale)
    for method, max_evaluations in SEARCH_STAGES:
        result = search_trust_region(
            problem.name,
            residuals,
            scaled,
            jac=jacobian,
            bounds=bounds,
            method=method,
            max_nfev=max_evaluations,
            **options,
        )
        scaled = result.x
        if result.status > 0 or is_budget_spent() or _is_converged(result):
            break
    else:
        evaluations = sum(count for _, count in SEARCH_STAGES)
        raise IdentificationError(
            f"{problem.origin}: the fit of {problem.name} did not converge in {evaluations}"
            " evaluations. Give initial values closer to those of the muscle, or"
            " choose a law with fewer parameters.",
            hint=Hint("To fix parameters", "fixed"),
            cause="the fit does not converge",
        )
    return problem.solution(np.clip(scaled * scale, low, high))


def _is_converged(result: Any) -> bool:
    """Whether the residuals are nearly orthogonal to the tangent space, though the search has not
    stopped. With redundant parameters it moves on without converging. The criterion is the relative
    offset of Bates and Watts, Technometrics 23:179 (1981)."""
    norms = np.linalg.norm(result.jac, axis=0)
    norms[norms == 0] = 1.0
    projection = np.linalg.lstsq(
        (result.jac / norms).T, result.grad / norms, rcond=_SINGULAR_TOLERANCE
    )[0]
    squares = float(projection @ projection)
    size = norms.size
    degrees_of_freedom = max(result.fun.size - size, 1)
    return bool(
        squares / size <= _RELATIVE_OFFSET**2 * (2 * result.cost - squares) / degrees_of_freedom
    )


def _check_finite(problem: LeastSquaresProblem, start: Array) -> None:
    values = problem.predict(start)
    bad = ~np.isfinite(values)
    if bad.any():
        raise IdentificationError(
            f"{problem.origin}: with its initial values {problem.name} gives no finite"
            f" {problem.quantity} at {np.count_nonzero(bad)} of {len(values)} points, the first at"
            f" {problem.describe_row(int(np.argmax(bad)))}. Give other initial values, or remove"
            " points outside the range of the law.",
            cause=f"it gives no finite {problem.quantity} with its initial values",
        )
