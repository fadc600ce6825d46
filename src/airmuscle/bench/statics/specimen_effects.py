"""Specimen effects (random effects) of a law of muscles of one type, by restricted maximum
likelihood.

The population parameters are those of least squares over all rows (working independence: Liang and
Zeger, Biometrika 73:13 (1986)). The effects of the specimens are polynomials in scaled contraction
and pressure, whose coefficients have a normal prior of mean 0 and one variance. Its ratio to the
residual variance maximises the restricted likelihood (Patterson and Thompson, Biometrika 58:545
(1971)); the effects are then the best linear unbiased predictions from the residuals of the
population law (Robinson, Statistical Science 6:15 (1991)). A slack row limits the force of its
specimen from above: the effects are then those of penalised least squares with one-sided residuals.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ..estimation import PooledCovariance, Sums, shortened_step

_MAX_ITERATIONS = 100
"""Maximum number of Newton steps; the iteration is finite and took fewer than 10 in all tests."""


class BoundedRows(NamedTuple):
    """Rows of one specimen: basis (N, K) of its effect, values (N,) that it should have, sides and
    weights (N,). The side is 0 for a value, 1 for an upper and -1 for a lower bound."""

    basis: Array
    values: Array
    side: Array
    weights: Array

    def active(self, coefficients: Array) -> npt.NDArray[np.bool_]:
        """Mask (N,) of the values, and of the bounds that an effect with these coefficients (K,)
        violates.
        """
        return np.asarray(
            (self.side == 0) | (self.side * (self.basis @ coefficients - self.values) > 0)
        )


def bounded_coefficients(rows: BoundedRows, ratio: float, start: Array) -> Array:
    """The coefficients (K,) that minimise the squares of values and violated bounds, and `ratio`
    times their own. The sum is convex and each iteration is a Newton step, halved until the sum
    does not increase. The result is the posterior mode of the coefficients for a normal prior and
    one-sided normal errors at the bounds.
    """
    coefficients = start
    active = rows.active(start)

    def sum_of_squares(x: Array) -> float:
        residuals = np.where(rows.active(x), rows.weights * (rows.basis @ x - rows.values), 0.0)
        return float(residuals @ residuals + ratio * x @ x)

    for _ in range(_MAX_ITERATIONS):
        weighted = np.where(active, rows.weights**2, 0.0)[:, None] * rows.basis
        normal = weighted.T @ rows.basis + ratio * np.eye(start.size)
        step = np.linalg.solve(normal, weighted.T @ rows.values) - coefficients
        limit = sum_of_squares(coefficients) * (1 + 1e-12)
        coefficients = coefficients + shortened_step(sum_of_squares, coefficients, step, limit)
        previous = active
        active = rows.active(coefficients)
        if np.array_equal(active, previous):
            break
    return coefficients


RATIO_RANGE = (-8.0, 10.0)
"""Decimal logarithms of the ratios of the residual variance to that of the effects that are
searched (chosen).
"""
_STEPS = (0.25, 0.01)
"""Steps of the search in decimal logarithms, one within the other (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class SpecimenEffects:
    """The effects of S specimens, with K coefficients each; all SI."""

    specimens: tuple[str, ...]
    coefficients: Array
    """Predicted coefficients, shape (S, K)."""
    deviation: float
    """Standard deviation of a coefficient between specimens."""
    sigma: float
    """Standard deviation of the residuals within the specimens."""
    degrees_of_freedom: float
    """Effective number of parameters of the effects: the trace of their smoother, from 0 to S K
    (Hodges and Sargent, Biometrika 88:367 (2001))."""
    covariance: PooledCovariance | None = None
    """That of the errors of population parameters and coefficients; None where only the law was
    asked for.
    """

    @property
    def standard_errors(self) -> Array:
        """Standard errors of the predicted coefficients, shape (S, K): 1.96 of them are half a 95 %
        interval.
        """
        assert self.covariance is not None
        return self.covariance.standard_errors[-self.coefficients.size :].reshape(
            self.coefficients.shape
        )


def predict_effects(sums: Sums, specimens: tuple[str, ...]) -> SpecimenEffects:
    """The effects, their variance and their standard errors."""
    scale = np.sqrt(np.diag(sums.xx))
    inverse = np.linalg.inv(sums.xx / np.outer(scale, scale)) / np.outer(scale, scale)
    projected = inverse @ sums.xz  # effects of the rows that the population law takes up
    within = sums.zz - sums.xz.T @ projected
    within = (within + within.T) / 2
    size = len(within)
    freedom = sums.rows - len(sums.xx)
    taken_up = (
        inverse @ sums.xr
    )  # not 0 where bounds keep the population law from the least squares of these rows
    gradient = sums.zr - sums.xz.T @ taken_up
    squares = sums.rr - float(sums.xr @ taken_up)
    ratio, sigma = _variance_ratio(within, gradient, squares, freedom)
    shrunk = np.linalg.inv(sums.zz + ratio * np.eye(size))
    coefficients = (shrunk @ sums.zr).reshape(len(specimens), -1)
    deviation = sigma / float(np.sqrt(ratio))
    return SpecimenEffects(
        specimens, coefficients, deviation, sigma, float(np.trace(shrunk @ within))
    )


def _variance_ratio(
    within: Array, gradient: Array, squares: float, freedom: float
) -> tuple[float, float]:
    """The ratio of variances with the largest restricted likelihood, and the standard deviation of
    the residuals. `within` and `gradient` are the normal matrix and the right-hand side of the
    effects, orthogonal to the population."""
    eigenvalues, vectors = np.linalg.eigh(within)
    eigenvalues = np.maximum(eigenvalues, 0.0)[:, None]
    components = ((vectors.T @ gradient) ** 2)[:, None]

    def sum_of_squares(ratio: Array) -> Array:
        return np.asarray(
            np.maximum(squares - np.sum(components / (eigenvalues + ratio), axis=0), 1e-300)
        )

    def likelihood(ratio: Array) -> Array:
        determinant = np.sum(np.log1p(eigenvalues / ratio), axis=0)
        return np.asarray(-0.5 * determinant - 0.5 * freedom * np.log(sum_of_squares(ratio)))

    exponents = np.arange(RATIO_RANGE[0], RATIO_RANGE[1] + _STEPS[0], _STEPS[0])
    best = float(exponents[int(np.argmax(likelihood(10.0**exponents)))])
    fine = np.clip(np.arange(best - _STEPS[0], best + _STEPS[0], _STEPS[1]), *RATIO_RANGE)
    ratio = 10.0 ** fine[int(np.argmax(likelihood(10.0**fine)))]
    sigma = float(np.sqrt(sum_of_squares(np.array([ratio]))[0] / max(freedom, 1)))
    return float(ratio), sigma
