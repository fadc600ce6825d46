"""Monotone fit of the exponential surface: contraction never rises with force and never falls with pressure.

A muscle cannot become shorter under more load, nor longer under more pressure. As k = k_max (1 - exp v) decreases with
v, and v is linear in its coefficients, these conditions are linear inequalities. They are imposed on the Bernstein
coefficients of the slopes of v on a few cells, which enclose the slopes, and therefore hold at every point of the
validity range, not only on a grid.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev

from ....core.arrays import Array
from ....core.errors import IdentificationError
from ....physics.muscle.characteristic.base import ContractionLaw
from ....recording import Recording
from .basis import LoadRange
from .bernstein import bernstein_coefficients, solve_constrained_least_squares
from .exponential import SurfaceFit, SurfaceProblem
from .monotonicity import MonotonicityRule, MonotonicityViolation, find_violations

MIN_SLOPE = 1e-9
"""Minimum slope of v on the validity range scaled to -1..1, so that rounding cannot change the sign; chosen."""


RISES_WITH_FORCE = MonotonicityRule("contraction rises with force", "contraction", 1, 1.0)
FALLS_WITH_PRESSURE = MonotonicityRule("contraction falls with pressure", "contraction", 0, -1.0)


def find_monotonicity_violations(
    law: ContractionLaw, validity_range: LoadRange | None = None, points: tuple[int, int] = (201, 201)
) -> tuple[MonotonicityViolation, ...]:
    """The regions of a validity range where k rises with F or falls with p, largest first.

    `validity_range` is by default that of the law. Exact slopes are evaluated on an even grid of `points` pressures and
    forces, edges included.
    """
    validity_range = validity_range or LoadRange.from_law(law)
    return find_violations(law, (RISES_WITH_FORCE, FALLS_WITH_PRESSURE), *validity_range.grid(*points))


def fit_monotone(
    recording: Recording,
    saturation: float,
    *,
    pressure_degree: int = 4,
    force_degree: int = 2,
    cells: tuple[int, int] = (16, 12),
) -> SurfaceFit:
    """Fit k by least squares with the constraint that it never rises with F and never falls with p.

    `recording` has pressure [Pa], force [N] and contraction [1]; `saturation` is k_max [1]. The slopes are enclosed on
    `cells` in pressure and force; more cells are slower and less conservative. The method is Gauss-Newton; each step
    solves a least-squares problem with linear inequalities. Raises IdentificationError.
    """
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    constraints = slope_constraints(pressure_degree, force_degree, cells)
    targets, weights = problem.linear_targets()
    coefficients = solve_constrained_least_squares(
        weights[:, None] * problem.design_matrix, weights * targets, constraints, MIN_SLOPE
    )
    for _ in range(200):
        residuals = problem.predict(coefficients) - problem.contraction
        jacobian = problem.jacobian(coefficients)
        right = jacobian @ coefficients - residuals
        step = solve_constrained_least_squares(jacobian, right, constraints, MIN_SLOPE) - coefficients
        # where no fraction of the step reduces the sum of squares, only rounding errors are left
        shorter = (t * step for t in 0.5 ** np.arange(20))
        accepted = (s for s in shorter if _sum_of_squares(problem, coefficients + s) <= residuals @ residuals)
        step = next(accepted, 0.0 * step)
        coefficients = coefficients + step
        if np.abs(step).max() < 1e-10:
            return problem.build_fit(coefficients, "nonlinear least squares, monotone on the validity range")
    raise IdentificationError(
        f"{recording.origin}: the monotone fit did not converge in 200 steps. Choose a lower degree or fewer cells."
    )


def _sum_of_squares(problem: SurfaceProblem, coefficients: Array) -> float:
    residuals = problem.predict(coefficients) - problem.contraction
    return float(residuals @ residuals)


def slope_constraints(pressure_degree: int, force_degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: v with Chebyshev coefficients c falls with p and rises with F on the validity range if all g @ c >= 0.

    The rows are the Bernstein coefficients of -dv/dx and dv/dy on every cell. A polynomial lies between its minimum and
    maximum Bernstein coefficient, so the condition is sufficient; on small cells it is nearly necessary.
    """
    falls_with_p = -np.kron(
        _bernstein_matrix(pressure_degree, cells[0], slope=True), _bernstein_matrix(force_degree, cells[1], slope=False)
    )
    rises_with_f = np.kron(
        _bernstein_matrix(pressure_degree, cells[0], slope=False), _bernstein_matrix(force_degree, cells[1], slope=True)
    )
    return np.vstack([falls_with_p, rises_with_f])


def _bernstein_matrix(degree: int, cells: int, *, slope: bool) -> Array:
    """Bernstein coefficients, on equal cells of -1..1, of T_0..T_degree or their slopes, one column each."""
    if not slope:
        return bernstein_coefficients(lambda x: np.asarray(chebyshev.chebvander(x, degree)), degree + 1, cells)
    derivatives = [chebyshev.chebder(unit) for unit in np.eye(degree + 1)]
    return bernstein_coefficients(
        lambda x: np.column_stack([chebyshev.chebval(x, d) for d in derivatives]), degree, cells
    )
