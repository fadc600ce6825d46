"""Statistics of a fit: correlation index, rank, condition number and standard errors."""

import dataclasses
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, IdentificationError
from .identifiability import singular_vectors
from .parameter_covariance import Runs, estimate_covariance
from .problem import LeastSquaresProblem, LeastSquaresSolution, RankDeficiency
from .ties import first_greatest
from .variable_projection import RANK_TOLERANCE
from .weighting import LeastSquares, Loss


@dataclasses.dataclass(frozen=True)
class CorrelationIndex:
    """IK = sqrt(1 - SSE/SST), SSE = Sum (k_i - y_i)^2, SST = Sum (mean(y) - y_i)^2; k_i modelled,
    y_i measured.

    Where SSE > SST the model is worse than the mean of the measurements and IK is undefined.
    Reference: Borzíková et al., the index given next to their plane curves.
    """

    r_squared: float
    """Coefficient of determination R^2 = 1 - SSE/SST [1], at most 1; negative where IK is
    undefined.
    """

    @property
    def value(self) -> float | None:
        """IK [1], or None where it is undefined; never NaN."""
        return math.sqrt(self.r_squared) if self.r_squared >= 0.0 else None

    def __str__(self) -> str:
        if self.value is None:
            return f"undefined, because 1 - SSE/SST = {self.r_squared:.4g} is negative"
        return f"IK = {self.value:.4f}"


def correlation_index(measured: npt.ArrayLike, modelled: npt.ArrayLike) -> CorrelationIndex:
    """The correlation index of modelled and measured values, shape (N,) each, in the same unit.
    Raises IdentificationError where a value is not finite, the shapes differ, there are fewer than
    two values, or the measured values do not vary."""
    y = np.asarray(measured, dtype=float)
    k = np.asarray(modelled, dtype=float)
    if y.shape != k.shape or y.size < 2:
        raise IdentificationError(
            f"correlation index: there are {y.size} measured and {k.size} modelled values; give the"
            " same number of each, at least two."
        )
    if not (np.isfinite(y).all() and np.isfinite(k).all()):
        raise IdentificationError(
            "correlation index: a value is not finite. Remove such rows first."
        )
    total = float(np.sum((y.mean() - y) ** 2))
    if total == 0.0:
        raise IdentificationError(
            "correlation index: undefined, because all measured values are equal."
        )
    return CorrelationIndex(1.0 - float(np.sum((k - y) ** 2)) / total)


_NULL_SHARE = 1e-3
"""Minimum share of a parameter in the null space, relative to the greatest one (chosen)."""
Mask = npt.NDArray[np.bool_]


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A fitted parameter with its standard error, NaN on a bound or without degrees of freedom;
    SI.
    """

    name: str
    label: str
    value: float
    stderr: float
    unit: str
    meaning: str
    on_bound: bool

    @property
    def display_unit(self) -> str:
        """The unit as text, empty for a dimensionless parameter."""
        return "" if self.unit == "1" else self.unit

    def format_interval(self) -> str:
        """Two standard errors as text, or why there are none."""
        if self.on_bound:
            return "on bound"
        return f"{2 * self.stderr:.3g}" if np.isfinite(self.stderr) else "unknown"


def fit_statistics(
    problem: LeastSquaresProblem, solution: LeastSquaresSolution, loss: Loss, runs: Runs
) -> dict[str, Any]:
    """Estimates and their covariance, rank and condition of a solution, as fields of a `Fit`.
    Raises IdentificationError where the design matrix is rank-deficient."""
    design = check_determined(problem, solution)
    active = problem.active_rows(solution.modelled)
    on_bound = ~design.columns
    counted = design
    residuals = problem.residuals(solution.modelled)[active]
    sigma, influences = _residual_std(residuals, design.norms.size, loss)
    if on_bound.any():
        complete = _Design.of(problem, solution, np.ones(on_bound.size, dtype=bool))
        counted = design if complete.null.any() else complete
    modelled = problem.weights * solution.modelled
    covariance = estimate_covariance(
        counted.basis,
        counted.matrix,
        influences,
        sigma,
        runs.rows(active),
        modelled[active],
        counted.columns,
    )
    if counted is not design:
        low, high = problem.bounds_reached(solution.values)
        covariance = covariance.within_bounds(low, high, -counted.matrix.T @ influences)
    standard_errors, correlations = covariance.of_parameters()
    standard_errors[on_bound] = np.nan
    correlations[on_bound] = np.nan
    correlations[:, on_bound] = np.nan
    singular = design.singular_values
    condition = float(singular[0] / singular[-1]) if singular.size else 1.0
    columns = (each.tolist() for each in (solution.values, standard_errors, on_bound))
    estimates = tuple(
        Estimate(
            parameter.name,
            parameter.label,
            value,
            stderr,
            parameter.unit,
            parameter.meaning,
            is_on_bound,
        )
        for parameter, value, stderr, is_on_bound in zip(problem.parameters, *columns, strict=True)
    )
    return {
        "estimates": estimates,
        "correlations": correlations,
        "parameter_covariance": covariance,
        "rank": singular.size,
        "condition": condition,
        "sigma": sigma,
    }


def check_determined(problem: LeastSquaresProblem, solution: LeastSquaresSolution) -> "_Design":
    """The design of the parameters that are not on a bound. Raises IdentificationError where it is
    rank-deficient.
    """
    low, high = problem.bounds_reached(solution.values)
    design = _Design.of(problem, solution, ~(low | high))
    if design.null.any():
        shares = np.sqrt(np.sum(design.right_singular_vectors[design.null] ** 2, axis=0))
        raise _rank_deficiency(problem, design.columns, shares, int(np.count_nonzero(~design.null)))
    return design


class _Design(NamedTuple):
    """Columns of the weighted design matrix of the active rows, a mask (P,): their norms, and the
    singular values and right singular vectors of the columns scaled to unit norm."""

    columns: Mask
    matrix: Array
    norms: Array
    singular_values: Array
    right_singular_vectors: Array

    @classmethod
    def of(
        cls, problem: LeastSquaresProblem, solution: LeastSquaresSolution, columns: Mask
    ) -> "_Design":
        """The singular values at a solution."""
        active = problem.active_rows(solution.modelled)
        whole = bool(active.all() and columns.all())
        selected = solution.jacobian if whole else solution.jacobian[np.ix_(active, columns)]
        matrix = np.multiply(problem.weights[active, None], selected, order="C")
        norms = np.linalg.norm(matrix, axis=0)
        return cls(
            columns, matrix, norms, *singular_vectors(matrix / np.where(norms > 0, norms, 1.0))
        )

    @property
    def null(self) -> Mask:
        """Mask of the singular values that count as zero."""
        return self.singular_values <= RANK_TOLERANCE * np.max(self.singular_values, initial=0.0)

    @property
    def basis(self) -> Array:
        """T with T T^T = (J^T J)^-1 of the columns."""
        return np.asarray(
            self.right_singular_vectors.T / self.singular_values / self.norms[:, None]
        )


def _residual_std(residuals: Array, parameters: int, loss: Loss) -> tuple[float, Array]:
    """The sigma for which sigma^2 (J^T J)^-1 is the covariance of the estimates, and psi/mean(psi')
    of every residual.

    For least squares these are sqrt(SSE/(N - P)) and the residuals; for a loss with influence
    function psi(e) = e rho' sigma is sqrt(Sum psi^2/(N - P))/mean(psi'). Reference: Huber, Robust
    Statistics (1981), section 7.6.
    """
    influences = residuals
    if residuals.size and not isinstance(loss, LeastSquares):
        z = (residuals / loss.scale) ** 2
        _, first, second = loss.rho(z)
        influences = residuals * first / np.mean(first + 2 * z * second)
    degrees_of_freedom = residuals.size - parameters
    if degrees_of_freedom <= 0:
        return float("nan"), influences
    return float(np.sqrt(np.sum(influences**2) / degrees_of_freedom)), influences


def _rank_deficiency(
    problem: LeastSquaresProblem, free: Mask, shares: Array, rank: int
) -> IdentificationError:
    """The error for the parameters with a share in the null space; `shares` (P,) are their norms in
    it.
    """
    labels = [parameter.label for parameter in itertools.compress(problem.parameters, free)]
    least = _NULL_SHARE * shares.max()
    inseparable = [label for label, share in zip(labels, shares, strict=True) if share > least]
    greatest = int(np.flatnonzero(free)[first_greatest(shares)])
    return problem.rank_error(RankDeficiency(inseparable, greatest, rank, len(labels)))
