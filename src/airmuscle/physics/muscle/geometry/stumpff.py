"""Stumpff functions: trigonometric and hyperbolic functions without the leading terms of their series.

    S_m(w) = Sum_n w^n / (m + 2 n)!

so that S_0 = cosh u, S_1 = sinh(u)/u, S_2 = (cosh u - 1)/u^2, S_3 = (sinh u - u)/u^3 with w = u^2, and accordingly
for cos and sin with w = -psi^2. They avoid the cancellation of sines and cosines in the formulas of a flat arc.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ....core.ops import Value

TERMS = 18
"""Number of terms; the first omitted term is below 1e-18 of the sum for |w| <= 45, the range of the meridians."""

_COEFFICIENTS = tuple(tuple(1.0 / math.factorial(m + 2 * n) for n in range(TERMS)) for m in range(6))


def power_series(coefficients: Sequence[float], w: Value) -> Value:
    """Sum of coefficients[n] w^n by Horner's method."""
    total: Value = coefficients[-1]
    for a in reversed(coefficients[:-1]):
        total = total * w + a
    return total


def stumpff(order: int, w: Value) -> Value:
    """S_order(w) for orders 0 to 5."""
    return power_series(_COEFFICIENTS[order], w)


def double_angle_term(w: Value) -> Value:
    """(u (cosh 2u + 2) - (3/2) sinh 2u)/u^5 with w = u^2, or with cos and sin of psi for w = -psi^2; 8/15 at zero."""
    return 16 * (stumpff(4, 4 * w) - 3 * stumpff(5, 4 * w))


def triple_angle_term(w: Value) -> Value:
    """(sinh(3u)/6 + (3/2) sinh u - 2 u cosh u)/u^5, or with cos and sin of psi for w = -psi^2; 4/15 at zero."""
    return 40.5 * stumpff(5, 9 * w) + 1.5 * stumpff(5, w) - 2 * stumpff(4, w)
