"""Where a contraction surface is impossible, and a fit that is possible everywhere on its validity range.

Under more load a muscle cannot be shorter, and under more pressure it cannot be longer: k must not rise with
F nor fall with p. As k = k_max (1 - exp v) falls with v, and v is linear in its coefficients, that is a set
of linear inequalities; written for the Bernstein coefficients of the slopes of v on a few cells, which
enclose the slopes, they hold at every point of the validity range and not on a grid alone.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev

from ...characteristic.base import ContractionLaw
from ...core.arrays import Array
from ...core.errors import IdentificationError
from ...recording import Recording
from .basis import LoadRange
from .bernstein import bernstein_coefficients, solve_constrained_least_squares
from .exponential import SurfaceFit, SurfaceProblem
from .monotonicity import MonotonicityRule, MonotonicityViolation, find_violations

MIN_SLOPE = 1e-9
"""Least slope of v on the validity range scaled to -1..1, so that rounding turns no level stretch round; chosen."""


RISES_WITH_FORCE = MonotonicityRule("contraction rises with force", "contraction", 1, 1.0)
FALLS_WITH_PRESSURE = MonotonicityRule("contraction falls with pressure", "contraction", 0, -1.0)


def find_monotonicity_violations(
    law: ContractionLaw, validity_range: LoadRange | None = None, points: tuple[int, int] = (201, 201)
) -> tuple[MonotonicityViolation, ...]:
    """The places in a validity range where k rises with F or falls with p, largest first.

    Without a validity range it is the law's own. Exact slopes are looked at on `points` even pressures and forces, edges included.
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
    """Fit k by least squares among the surfaces that never rise with F nor fall with p.

    `recording` has pressure [Pa], force [N] and contraction [1]; `saturation` is k_max [1]. The slopes are
    enclosed on `cells` parts of the validity range in pressure and force; more of them cost time and lose less.
    Gauss-Newton steps, each a least-squares problem under linear inequalities. Raises IdentificationError.
    """
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    constraints = slope_constraints(pressure_degree, force_degree, cells)
    targets, weights = problem.linear_targets()
    found = solve_constrained_least_squares(
        weights[:, None] * problem.design_matrix, weights * targets, constraints, MIN_SLOPE
    )
    for _ in range(200):
        errors = problem.predict(found) - problem.contraction
        slopes = problem.jacobian(found)
        step = solve_constrained_least_squares(slopes, slopes @ found - errors, constraints, MIN_SLOPE) - found
        # where no part of the step helps, rounding is all that is left
        shorter = (t * step for t in 0.5 ** np.arange(20))
        step = next((s for s in shorter if _sum_of_squares(problem, found + s) <= errors @ errors), 0.0 * step)
        found = found + step
        if np.abs(step).max() < 1e-10:
            return problem.build_fit(found, "nonlinear least squares, monotone on the validity range")
    raise IdentificationError(
        f"{recording.origin}: the monotone fit did not settle in 200 steps. Lower a degree, or fewer cells."
    )


def _sum_of_squares(problem: SurfaceProblem, coefficients: Array) -> float:
    errors = problem.predict(coefficients) - problem.contraction
    return float(errors @ errors)


def slope_constraints(pressure_degree: int, force_degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: v with Chebyshev coefficients c falls with p and rises with F on the validity range if all g @ c >= 0.

    They are the Bernstein coefficients of -dv/dx and dv/dy on every cell; a polynomial lies between the least
    and the greatest of its Bernstein coefficients, so the condition suffices. It is nearly necessary on small
    cells.
    """
    falls_with_p = -np.kron(
        _bernstein_matrix(pressure_degree, cells[0], slope=True), _bernstein_matrix(force_degree, cells[1], slope=False)
    )
    rises_with_f = np.kron(
        _bernstein_matrix(pressure_degree, cells[0], slope=False), _bernstein_matrix(force_degree, cells[1], slope=True)
    )
    return np.vstack([falls_with_p, rises_with_f])


def _bernstein_matrix(degree: int, cells: int, *, slope: bool) -> Array:
    """Bernstein coefficients, on even cells of -1..1, of T_0..T_degree or their slopes, one column each."""
    if not slope:
        return bernstein_coefficients(lambda x: np.asarray(chebyshev.chebvander(x, degree)), degree + 1, cells)
    derived = [chebyshev.chebder(unit) for unit in np.eye(degree + 1)]
    return bernstein_coefficients(lambda x: np.column_stack([chebyshev.chebval(x, d) for d in derived]), degree, cells)
