"""Equilibrium of the contractile element behind the series spring."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.arrays import Array
from ...core.ops import Value

CONTRACTION_TOLERANCE = 1e-15
"""Contractions that differ by less are equal (chosen, a few rounding errors)."""
MAX_ITERATIONS = 200
Imbalance = Callable[[Value, Value, Value], tuple[Array, Array]]
"""Force imbalance [N] and its derivative with respect to the inner contraction [N], as a function of gauge pressure
[Pa], inner contraction and contraction of the muscle."""


def without_derivative(imbalance: Callable[[Value, Value, Value], Value]) -> Imbalance:
    """The imbalance of a law that is not closed-form; its derivative is NaN, so that bisection is used."""

    def evaluate(pressure: Value, inner: Value, contraction: Value) -> tuple[Array, Array]:
        value = np.asarray(imbalance(pressure, inner, contraction), dtype=float)
        return value, np.full(value.shape, np.nan)

    return evaluate


def solve_inner_contraction(
    imbalance: Imbalance, compliance_force: Value, limits: tuple[Value, Value], pressure: Value, contraction: Value
) -> Value:
    """Inner contraction at which the force of the contractile element equals that of the series spring.

    `compliance_force` [N] is the spring's stiffness times the resting length, `limits` are the contraction limits of
    the geometry, `pressure` is gauge [Pa], `contraction` that of the muscle between its fittings. Arrays broadcast,
    also those of the parameters. The imbalance decreases over the bracket, so the solution is unique. Where the
    contractile element pushes and the spring is slack, the solution is the largest inner contraction without a push.
    """
    min_contraction, max_contraction = limits
    pull, _ = imbalance(pressure, contraction, contraction)
    start = contraction + np.zeros(np.shape(pull))
    stretched = np.minimum(start + np.maximum(pull, 0.0) / compliance_force, np.maximum(max_contraction, start))
    low = np.where(np.less(pull, 0.0), np.minimum(min_contraction, start), start)
    high = np.where(np.less(pull, 0.0), start, stretched)
    solution = find_largest_nonnegative(lambda inner: imbalance(pressure, inner, contraction), low, high, start)
    return solution if solution.ndim else float(solution)


def find_largest_nonnegative(
    function: Callable[[Array], tuple[Array, Array]], low: Array, high: Array, start: Array
) -> Array:
    """The largest x in [low, high] at which a decreasing function is not negative; element-wise, shape (N,) or ().

    `function` returns value and derivative. Newton's method from `start`, safeguarded by bisection: the bracket is
    halved where a Newton step would leave it or is longer than half the previous step.
    """
    x, previous, solution = start, high - low, start
    searching = np.ones(np.shape(start), dtype=bool)
    for _ in range(MAX_ITERATIONS):
        value, slope = function(x)
        low, high = np.where(np.greater_equal(value, 0.0), x, low), np.where(np.greater_equal(value, 0.0), high, x)
        with np.errstate(all="ignore"):
            step = -np.divide(value, slope)  # NaN where the function is constant at zero: bisect to its upper end
        newton = (x + step >= low) & (x + step <= high)
        close = newton & (np.abs(step) <= CONTRACTION_TOLERANCE)
        middle = 0.5 * (low + high)
        ahead = np.where(close | (newton & (2.0 * np.abs(step) <= np.abs(previous))), x + step, middle)
        previous, x = ahead - x, ahead
        solution = np.where(searching, x, solution)
        searching &= ~close & (high - low > CONTRACTION_TOLERANCE)
        if not searching.any():
            break
    return solution
