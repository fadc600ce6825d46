"""Recursive least squares of a contractile surface, sample by sample, with the next point of a
D-optimal experiment.

The triangular factor R of the normal equations, R^T R = Sum phi phi^T, and Q^T F are updated by one
orthogonal transformation for each sample (square-root information filter), so that the coefficients
are those of the fit to all samples at once. The next point maximises det(M + phi phi^T) = det M (1
+ phi^T M^-1 phi), the variance of the predicted force. References: Bierman, G. J., Factorization
Methods for Discrete Sequential Estimation, Academic Press, 1977; Fedorov, V. V., Theory of Optimal
Experiments, Academic Press, 1972.
"""

import dataclasses
import functools
from typing import Any, NamedTuple

import numpy as np

from ...core import (
    Array,
    IdentificationError,
    ParameterError,
    ShortRepr,
    abridged,
    check_field_types,
    within,
)
from ...physics.muscle.characteristic import ContractileSurface, ValidityRange, exponents
from ..estimation import first_greatest
from .experiment_design import LEVEL_COUNT, BenchLimits

PRIOR = 1e-4
"""Information on each coefficient before the first sample, relative to one sample (chosen): a prior
standard deviation of 10 000 times that of a sample, so that points can be compared before all
coefficients are determined."""
DETERMINED = 1.0
"""Variance of a predicted force, relative to that of a sample, below which it is determined by the
samples (chosen).
"""


class NextPoint(NamedTuple):
    """Point to measure next: gauge pressure [Pa], contraction [1], expected force and its standard
    error [N].
    """

    pressure: float
    contraction: float
    force: float
    standard_error: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecursiveFit(ShortRepr):
    """Contractile surface fitted to the samples so far; `updated` returns it with one more sample.

    limits      range of the test rig, on which the surface is scaled, and its maximum force
    degree      degree of the polynomial; (degree + 1)(degree + 2)/2 coefficients
    sigma       standard deviation of a force [N], used until the residuals determine it
    forgetting  weight of the information of all former samples at each sample, 1 for none lost;
                less follows a muscle that changes
    """

    limits: BenchLimits
    degree: int = within(0, 9, default=5)
    sigma: float = 1.0
    forgetting: float = 1.0
    samples: int = 0
    outside: int = 0
    """Samples outside the limits, which are left out."""
    factor: Array = dataclasses.field(default_factory=lambda: np.empty((0, 0)), repr=False)
    """Triangular factor of the normal equations with the right-hand side, shape (P + 1, P + 1)."""
    squared_factor: Array = dataclasses.field(default_factory=lambda: np.empty((0, 0)), repr=False)
    """Triangular factor of the sum of w^2 phi phi^T over the samples of weight w, shape (P, P);
    without forgetting it is that of the normal equations, and empty here."""

    def __post_init__(self) -> None:
        check_field_types(self)
        for name in ("factor", "squared_factor"):
            if not isinstance(getattr(self, name), np.ndarray):
                raise ParameterError(
                    f"RecursiveFit: {name} must be an array; it is {abridged(getattr(self, name))}."
                )
        if not self.sigma > 0 or not 0.5 < self.forgetting <= 1.0 or not self.limits.max_force > 0:
            raise ParameterError(
                f"RecursiveFit: sigma is {self.sigma:g}, forgetting {self.forgetting:g} and the"
                f" maximum force {self.limits.max_force:g}; allowed range: sigma and force above 0,"
                " forgetting 0.5 to 1."
            )
        if not self.factor.size:
            size = len(exponents(self.degree)) + 1
            object.__setattr__(self, "factor", np.diag([PRIOR] * (size - 1) + [0.0]))
            if self.forgetting < 1.0:
                object.__setattr__(self, "squared_factor", PRIOR * np.eye(size - 1))

    def updated(self, pressure: float, contraction: float, force: float) -> "RecursiveFit":
        """The fit with one more sample [Pa, 1, N]. A sample outside the limits is counted and left
        out.
        """
        if not self.limits.validity_range.contains(pressure, contraction):
            return dataclasses.replace(self, outside=self.outside + 1)
        row = np.empty(len(self.factor))
        factor = self.factor
        square = self.squared_factor
        row[:-1] = self._terms(np.array([pressure]), np.array([contraction]))[0]
        row[-1] = force
        if self.forgetting < 1.0:
            factor = np.sqrt(self.forgetting) * factor
            square = _with_row(self.forgetting * square, row[:-1])
        return dataclasses.replace(
            self, factor=_with_row(factor, row), squared_factor=square, samples=self.samples + 1
        )

    @functools.cached_property
    def coefficients(self) -> Array:
        """Coefficients [N] of the scaled polynomial, shape (P,)."""
        return self._inverse @ self.factor[:-1, -1]

    @functools.cached_property
    def _inverse(self) -> Array:
        """Inverse of the triangular factor, shape (P, P)."""
        return np.asarray(_lapack().dtrtri(self.factor[:-1, :-1])[0])

    @property
    def rmse(self) -> float:
        """Root mean square of the residuals [N]; NaN before the first sample."""
        return (
            float(abs(self.factor[-1, -1]) / np.sqrt(self._total_weight))
            if self.samples
            else np.nan
        )

    @property
    def _total_weight(self) -> float:
        """Sum of the weights of the samples, of which the last has 1."""
        kept = self.forgetting
        count = self.samples
        return float(count) if kept == 1.0 else (1.0 - kept**count) / (1.0 - kept)

    @property
    def noise(self) -> float:
        """Standard deviation of a force [N]: of the residuals once their weights add up to twice
        the coefficients.

        The weighted sum of squares has the expectation sigma^2 (W - tr(M^-1 M_2)), with the sum W
        of the weights w, M = Sum w phi phi^T and M_2 = Sum w^2 phi phi^T; without forgetting the
        trace is the number of coefficients.
        """
        total = self._total_weight
        count = self.coefficients.size
        if total < 2 * count:
            return self.sigma
        used = (
            count
            if self.forgetting == 1.0
            else float(np.sum((self.squared_factor @ self._inverse) ** 2))
        )
        return float(abs(self.factor[-1, -1]) / np.sqrt(total - used))

    @property
    def model(self) -> ContractileSurface:
        """The surface. Raises IdentificationError while the samples do not determine it within the
        limits.
        """
        if (share := self.determined) < 1.0:
            raise IdentificationError(
                f"the samples determine the force on {100 * share:.0f} % of the range of the test"
                " rig. Measure more points, reduce the range, or choose a smaller degree."
            )
        span = self.limits.validity_range
        return ContractileSurface(
            tuple(self.coefficients),
            *span.pressure,
            *span.contraction,
            0.0,
            self.limits.max_force,
            self.degree,
        )

    @property
    def determined(self) -> float:
        """Share of the range of the test rig, from 0 to 1, on which the samples determine the force
        better than one sample at the point would."""
        return float(
            np.mean(self._variance(_grid(self.limits.validity_range, self.degree)[2]) < DETERMINED)
        )

    def force(self, pressure: float, contraction: float) -> tuple[float, float]:
        """Predicted force and its standard error [N], without the limits of the force."""
        terms = self._terms(np.array([pressure]), np.array([contraction]))
        return float((terms @ self.coefficients)[0]), float(
            self.noise * np.sqrt(self._variance(terms)[0])
        )

    def next_point(self) -> NextPoint:
        """The most informative point within the limits, of a grid of 13 x 13 points.

        Points with a predicted force above the maximum, and those where the muscle is certainly
        slack (below zero by two standard errors), are left out. Raises IdentificationError if no
        point remains.
        """
        pressure, contraction, terms = _grid(self.limits.validity_range, self.degree)
        force = terms @ self.coefficients
        variance = self._variance(terms)
        error = self.noise * np.sqrt(variance)
        feasible = (force <= self.limits.max_force) & (force + 2 * error >= 0.0)
        if not feasible.any():
            raise IdentificationError(
                "no point of the range has a predicted force between 0 and"
                f" {self.limits.max_force:g} N. Widen the limits, or check the units."
            )
        best = first_greatest(np.where(feasible, variance, -1.0))
        return NextPoint(
            float(pressure[best]), float(contraction[best]), float(force[best]), float(error[best])
        )

    def _variance(self, terms: Array) -> Array:
        """Variance of the predicted force, relative to that of a sample, shape (N,): phi^T M^-1 M_2
        M^-1 phi, which is phi^T M^-1 phi without forgetting. By the definitions of `noise`."""
        shares = terms @ self._inverse
        if self.forgetting < 1.0:
            shares = shares @ self._inverse.T @ self.squared_factor.T
        return np.asarray(np.sum(shares**2, axis=1))

    def _terms(self, pressure: Array, contraction: Array) -> Array:
        return _terms(pressure, contraction, self.limits.validity_range, self.degree)


@functools.cache
def _lapack() -> Any:
    """The LAPACK routines of SciPy, whose call costs less than that of their NumPy counterparts."""
    from scipy.linalg import lapack

    return lapack


def _with_row(factor: Array, row: Array) -> Array:
    """Triangular factor of R^T R + r r^T for a triangular factor R, shape (P, P), and a row r,
    shape (P,).
    """
    rows = np.empty((len(factor) + 1, len(factor)))
    rows[:-1] = factor
    rows[-1] = row
    return np.asarray(np.triu(_lapack().dgeqrf(rows, overwrite_a=True)[0][:-1]))


def _terms(pressure: Array, contraction: Array, span: ValidityRange, degree: int) -> Array:
    """Powers of contraction and pressure, scaled to -1 to 1, shape (N, P), in the order of the
    coefficients.
    """
    pressures = span.pressure
    contractions = span.contraction
    x = (2 * contraction - sum(contractions)) / (contractions[1] - contractions[0])
    q = (2 * pressure - sum(pressures)) / (pressures[1] - pressures[0])
    x_powers, q_powers = (np.vander(v, degree + 1, increasing=True) for v in (x, q))
    i, j = _powers(degree)
    return np.asarray(x_powers[:, i] * q_powers[:, j])


@functools.cache
def _powers(degree: int) -> Array:
    return np.transpose(exponents(degree))


@functools.lru_cache(maxsize=8)
def _grid(span: ValidityRange, degree: int) -> tuple[Array, Array, Array]:
    """All pairs of evenly spaced levels of pressure and contraction, shape (N,) each, and their
    terms (N, P).
    """
    axes = (np.linspace(*limits, LEVEL_COUNT) for limits in (span.pressure, span.contraction))
    pressure, contraction = map(np.ravel, np.meshgrid(*axes, indexing="ij"))
    return pressure, contraction, _terms(pressure, contraction, span, degree)
