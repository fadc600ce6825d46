"""Statistics of a static fit: errors of rows, correlation index, rank, condition number and
standard errors.
"""

import dataclasses
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, Hint, IdentificationError
from ...physics.muscle.characteristic import ContractileSurface
from ...recording import Recording
from ..inspection import RELATIVE_BAND, level_intervals, rounding
from .identifiability import singular_vectors
from .parameter_covariance import Runs, estimate_covariance
from .problem import POINT_COLUMNS, FitProblem, LeastSquaresSolution
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


@dataclasses.dataclass(frozen=True)
class WorstPoint:
    """The residual (model - measured) of maximum magnitude and the point where it occurs, all
    SI.
    """

    error: float
    pressure: float
    contraction: float
    force: float


def goodness_of_fit(problem: FitProblem, modelled: Array, data: Recording) -> dict[str, Any]:
    """The rms error, maximum error and correlation index of a law, as fields of a `Fit`. The error
    at a row is model - measured, with the model (N,) clamped; at a censored row it is the violation
    of its bound, because its reading is not a measured value. The squares of violations are added
    to those of measured rows."""
    measured = problem.censoring == 0
    target = data[problem.fitted_quantity.name]
    errors = problem.residuals(modelled) / problem.weights
    worst = int(np.argmax(np.abs(errors)))
    varies = float(np.ptp(target[measured])) > rounding("", target[measured])
    return {
        "rmse": float(np.sqrt(errors @ errors / max(int(np.count_nonzero(measured)), 1))),
        "max_error": WorstPoint(
            float(errors[worst]), *(float(data[name][worst]) for name in POINT_COLUMNS)
        ),
        "correlation_index": (
            correlation_index(target[measured], modelled[measured]) if varies else None
        ),
    }


_MAX_NAMES = 3
"""Maximum number of parameters that the cause of a rank deficiency lists (chosen)."""
Mask = npt.NDArray[np.bool_]
DEGREE_REMEDY = "For the greatest degree that the levels determine"


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
    problem: FitProblem, solution: LeastSquaresSolution, loss: Loss, runs: Runs
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
    covariance = estimate_covariance(
        counted.basis, counted.matrix, influences, sigma, runs.rows(active), counted.columns
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
            leaf.path, label, value, stderr, leaf.declared.unit, leaf.declared.meaning, is_on_bound
        )
        for leaf, label, value, stderr, is_on_bound in zip(
            problem.free_leaves, problem.labels, *columns, strict=True
        )
    )
    return {
        "estimates": estimates,
        "correlations": correlations,
        "parameter_covariance": covariance,
        "rank": singular.size,
        "condition": condition,
        "sigma": sigma,
    }


def check_determined(problem: FitProblem, solution: LeastSquaresSolution) -> "_Design":
    """The design of the parameters that are not on a bound. Raises IdentificationError where it is
    rank-deficient.
    """
    low, high = problem.bounds_reached(solution.values)
    design = _Design.of(problem, solution, ~(low | high))
    if design.null.any():
        shares = np.sqrt(np.sum(design.right_singular_vectors[design.null] ** 2, axis=0))
        raise _rank_deficiency(problem, design.columns, shares, int(np.count_nonzero(~design.null)))
    return design


def check_determined_by_levels(
    problem: FitProblem, solution: LeastSquaresSolution, at_levels: Recording
) -> None:
    """Raise IdentificationError where only the noise or ripple of a constant quantity determines
    the parameters. `at_levels` are the data of the problem with the constant quantity of each run
    at its level."""
    data = problem.data
    arguments = problem.fitted_quantity.arguments
    if at_levels is data or all(np.array_equal(at_levels[name], data[name]) for name in arguments):
        return
    levelled = dataclasses.replace(problem, data=at_levels)
    check_determined(levelled, solution._replace(jacobian=levelled.jacobian(solution.values)))


class _Design(NamedTuple):
    """Columns of the weighted design matrix of the active rows, a mask (P,): their norms, and the
    singular values and right singular vectors of the columns scaled to unit norm."""

    columns: Mask
    matrix: Array
    norms: Array
    singular_values: Array
    right_singular_vectors: Array

    @classmethod
    def of(cls, problem: FitProblem, solution: LeastSquaresSolution, columns: Mask) -> "_Design":
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
    problem: FitProblem, free: Mask, shares: Array, rank: int
) -> IdentificationError:
    """The parameters with a share in the null space, and what to do; `shares` (P,) are their norms
    in it.
    """
    labels = list(itertools.compress(problem.labels, free))
    names = [
        label for label, share in zip(labels, shares, strict=True) if share > 1e-3 * shares.max()
    ]
    quantities = problem.fitted_quantity.arguments
    levels = [count_levels(values) for values in problem.arguments]
    counts = [f"{count} of {name}" for count, name in zip(levels, quantities, strict=True)]
    path = problem.free_leaves[int(np.flatnonzero(free)[first_greatest(shares)])].path
    law = type(problem.law).__name__
    ranks = f"(rank {rank} of {len(labels)} parameters)"
    listed = ", ".join(names[:_MAX_NAMES])
    more = f" and {len(names) - _MAX_NAMES} other parameters" if len(names) > _MAX_NAMES else ""
    few = [names[0], f"{len(names) - 1} other parameters"] if more else names
    what = f"cannot separate {listed}{more}"
    cause = f"cannot separate {' and '.join(few)}"
    if len(names) == 1:
        what = cause = f"do not depend on {names[0]}"
    text = ""
    hint = Hint("To fix one parameter", "fixed", (path,))
    if isinstance(problem.law, ContractileSurface):
        text = (
            "a(x^i q^j) is the coefficient of the powers i of the contraction and j of the"
            " pressure, each scaled to -1..1; powers up to n need n + 1 levels. "
        )
        degree = min(levels) - 1  # the greatest for the pure powers of each quantity
        if 0 < degree < problem.law.degree:
            hint = Hint(DEGREE_REMEDY, "degree", degree, "characteristic.ContractileSurface.blank")
    return IdentificationError(
        f"{problem.data.origin}: the data {what} of {law} {ranks}. Number of levels:"
        f" {', '.join(counts)}. {text}Measure at more levels, or choose a lower degree or a law"
        " with fewer parameters.",
        hint=hint,
        cause=f"the data {cause} (rank {rank} of {len(labels)})",
    )


def count_levels(values: Array) -> int:
    """The number of levels: of groups of values that differ by at most the band of a constant
    quantity.
    """
    band = RELATIVE_BAND * float(np.max(np.abs(values), initial=0.0))
    return sum(1 for _ in level_intervals(np.sort(values), band))
