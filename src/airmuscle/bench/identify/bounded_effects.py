"""Effects of a specimen under bounds: penalised least squares in which a slack row limits the force from above."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array

_MAX_ITERATIONS = 100
"""Maximum number of Newton steps; the iteration is finite and took fewer than 10 in all tests."""
_MAX_REDUCTIONS = 30


class BoundedRows(NamedTuple):
    """Rows of one specimen: basis (N, K) of its effect, values (N,) that it should have, sides and weights (N,).

    The side is 0 for a value, 1 for an upper and -1 for a lower bound.
    """

    basis: Array
    values: Array
    side: Array
    weights: Array

    def joined(self, other: BoundedRows) -> BoundedRows:
        """These rows followed by others."""
        return BoundedRows(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def active(self, coefficients: Array) -> npt.NDArray[np.bool_]:
        """Mask (N,) of the values, and of the bounds that an effect with these coefficients (K,) violates."""
        return np.asarray((self.side == 0) | (self.side * (self.basis @ coefficients - self.values) > 0))

    def sum_of_squares(self, coefficients: Array, ratio: float) -> float:
        """The weighted squares of the active rows and the penalty."""
        residuals = np.where(self.active(coefficients), self.weights * (self.basis @ coefficients - self.values), 0.0)
        return float(residuals @ residuals + ratio * coefficients @ coefficients)


def bounded_coefficients(rows: BoundedRows, ratio: float, start: Array) -> Array:
    """The coefficients (K,) that minimise the squares of values and violated bounds, and `ratio` times their own.

    The sum is convex and each iteration is a Newton step, halved until the sum does not increase. The result is the
    posterior mode of the coefficients for a normal prior and one-sided normal errors at the bounds.
    """
    coefficients, active = start, rows.active(start)
    for _ in range(_MAX_ITERATIONS):
        weighted = np.where(active, rows.weights**2, 0.0)[:, None] * rows.basis
        normal = weighted.T @ rows.basis + ratio * np.eye(start.size)
        step = np.linalg.solve(normal, weighted.T @ rows.values) - coefficients
        limit = rows.sum_of_squares(coefficients, ratio) * (1 + 1e-12)
        factors = 0.5 ** np.arange(_MAX_REDUCTIONS)
        factor = next((t for t in factors if rows.sum_of_squares(coefficients + t * step, ratio) <= limit), 0.0)
        coefficients = coefficients + factor * step
        previous, active = active, rows.active(coefficients)
        if np.array_equal(active, previous):
            break
    return coefficients
