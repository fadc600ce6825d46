"""Limits of a parameter by its profile likelihood.

Reference: Bates and Watts (1988), Nonlinear Regression, 6.1.
"""

import numpy as np

from ...core import Array
from .problem import LeastSquaresProblem
from .solver import solve_least_squares
from .weighting import LeastSquares

_MAX_DOUBLINGS = 12
"""Maximum number of outward steps, each twice the previous one: up to 4096 standard errors."""
_BISECTIONS = 18


def profile_limits(
    problem: LeastSquaresProblem, values: Array, index: int, standard_error: float, excess: float
) -> tuple[float, float]:
    """The lower and upper value of the parameter of this index at which the sum of squares,
    minimised over the others, exceeds that of the solution `values` (P,) by the share `excess`;
    infinite where it never does, or where a bound is reached first. The search starts in steps of
    the standard error."""
    threshold = _sum_of_squares(problem, values) * (1 + excess)
    value = float(values[index])
    low = _find_limit(problem, index, value, -standard_error, threshold)
    high = _find_limit(problem, index, value, standard_error, threshold)
    return low, high


def _sum_of_squares(problem: LeastSquaresProblem, values: np.ndarray) -> float:
    return float(np.sum(problem.residuals(problem.predict(values)) ** 2))


def _find_limit(
    problem: LeastSquaresProblem, index: int, value: float, step: float, threshold: float
) -> float:
    """The value at which the profile exceeds the threshold on one side; infinite where it never
    does, or where a bound is reached first."""
    bounds = problem.parameters[index].bounds

    def is_beyond(trial: float) -> bool:
        constrained = problem.with_known(index, trial)
        values = np.zeros(0)
        if constrained.parameters:
            values = solve_least_squares(constrained, LeastSquares()).values
        return _sum_of_squares(constrained, values) > threshold

    inside = value
    outside = value
    unbounded = float(np.copysign(np.inf, step))
    for doubling in range(_MAX_DOUBLINGS):
        inside = outside
        outside = float(np.clip(value + step * 2.0**doubling, *bounds))
        if inside == outside:  # the bound is reached below the threshold
            return unbounded
        if is_beyond(outside):
            break
    else:
        return unbounded
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2
        inside, outside = (inside, middle) if is_beyond(middle) else (middle, outside)
    return (inside + outside) / 2
