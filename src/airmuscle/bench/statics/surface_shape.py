"""Shape of static laws: regions with a slope of the wrong sign, and surfaces fitted without them.

A muscle cannot become shorter under more load, nor longer under more pressure; its force cannot
fall with pressure, nor rise with contraction. Both are linear in the coefficients of a force
surface, and in those of v in the exponential surface k = k_max (1 - exp v), which decreases with v.
On an interval (cell) a polynomial lies between its minimum and maximum Bernstein coefficient.
Slopes whose Bernstein coefficients have the required sign on every cell therefore have it
everywhere, not only on a grid.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from ...core import DASHES, LINES, Array, IdentificationError, legend_outside, new_figure
from ...physics.muscle.characteristic import ContractileSurface, ForceLaw, exponents
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Plot
from ..estimation import levels_of, shortened_step
from ..reported import Reported
from .exponential_surface import SurfaceFit, SurfaceProblem
from .static_fit import fit
from .static_fit_result import Fit
from .surface_violations import MonotonicityViolation, find_shape_violations, violation_table

Columns = Callable[[Array, int], Any]
"""Values (N, degree + 1) at N points of the polynomials of a basis up to a degree, or of their
slopes.
"""


def slope_rows(
    values: Columns, slopes: Columns, degrees: tuple[int, int], cells: tuple[int, int]
) -> tuple[Array, Array]:
    """Bernstein coefficients of the slopes of a surface by its first and by its second argument, on
    equal cells of -1..1, one column for each of its coefficients; the basis of each argument has
    these `values` and `slopes`.
    """
    pairs = list(zip(degrees, cells, strict=True))
    plain = [_bernstein_coefficients(values, degree, degree + 1, count) for degree, count in pairs]
    steep = [_bernstein_coefficients(slopes, degree, degree, count) for degree, count in pairs]
    return np.asarray(np.kron(steep[0], plain[1])), np.asarray(np.kron(plain[0], steep[1]))


def _bernstein_coefficients(columns: Columns, degree: int, size: int, cells: int) -> Array:
    """Bernstein coefficients, on equal cells of -1..1, of polynomials of degree below `size`, one
    column each.
    """
    if not size:  # the slopes of a constant
        return np.zeros((0, degree + 1))
    t = np.linspace(0.0, 1.0, size) if size > 1 else np.array([0.5])
    order = np.arange(size)
    binomials = np.array([math.comb(size - 1, int(j)) for j in order])
    at = t[:, None]
    bernstein = binomials * at**order * (1.0 - at) ** (size - 1 - order)
    coefficients = []
    for low, high in itertools.pairwise(np.linspace(-1.0, 1.0, cells + 1)):
        values = columns(low + (high - low) * t, degree)
        coefficients.append(np.linalg.solve(bernstein, values))
    return np.vstack(coefficients)


def solve_constrained_least_squares(
    matrix: Array, right: Array, rows: Array, minimum: float
) -> Array:
    """The x that minimises |matrix x - right| subject to rows x >= minimum.

    With matrix = Q R and z = R x - Q^T right it is the shortest z with rows R^-1 z >= minimum -
    rows R^-1 Q^T right, which Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23,
    reduce to non-negative least squares. Raises IdentificationError where no x satisfies the
    constraints.
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import nnls

    q, r = np.linalg.qr(matrix)
    unconstrained = q.T @ right
    if not len(rows):
        return np.asarray(solve_triangular(r, unconstrained))
    inner = solve_triangular(r, rows.T, trans="T").T
    dual_matrix = np.vstack([inner.T, minimum - inner @ unconstrained])
    target = np.eye(len(dual_matrix))[-1]
    dual, remainder = nnls(dual_matrix, target, maxiter=50 * len(rows))
    residual = dual_matrix @ dual - target
    if remainder < 1e-12:
        raise IdentificationError(
            "no surface of this degree satisfies the shape constraints. Choose a higher degree."
        )
    return np.asarray(solve_triangular(r, -residual[:-1] / residual[-1] + unconstrained))


MIN_SLOPE = 1e-9
"""Minimum slope of v, and of a force surface by its maximum force, on the validity range scaled to
-1..1, so that rounding cannot change the sign (chosen)."""


def fit_monotone(
    recording: Recording,
    saturation: float,
    *,
    pressure_degree: int = 4,
    force_degree: int = 2,
    cells: tuple[int, int] = (16, 12),
) -> SurfaceFit:
    """Fit k by least squares with the constraint that it never rises with F and never falls with p.
    The arguments are those of `fit_linearised`. The slopes are enclosed on `cells` in pressure and
    force; more cells are slower and less conservative. The method is Gauss-Newton; each step solves
    a least-squares problem with linear inequalities. Raises IdentificationError."""
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    constraints = slope_constraints(pressure_degree, force_degree, cells)
    coefficients = solve_constrained_least_squares(*problem.linear_system(), constraints, MIN_SLOPE)

    def sum_of_squares(c: Array) -> float:
        residuals = problem.predict(c) - problem.target
        return float(residuals @ residuals)

    for _ in range(200):
        jacobian = problem.jacobian(coefficients)
        right = jacobian @ coefficients - (problem.predict(coefficients) - problem.target)
        step = (
            solve_constrained_least_squares(jacobian, right, constraints, MIN_SLOPE) - coefficients
        )
        # where no fraction of the step reduces the sum of squares, only rounding errors are left
        step = shortened_step(
            sum_of_squares, coefficients, step, sum_of_squares(coefficients), halvings=20
        )
        coefficients = coefficients + step
        if np.abs(step).max() < 1e-10:
            return problem.build_fit(
                coefficients, "nonlinear least squares, monotone on the validity range"
            )
    raise IdentificationError(
        f"{recording.origin}: the monotone fit did not converge in 200 steps. Choose a lower degree"
        " or fewer cells."
    )


def slope_constraints(pressure_degree: int, force_degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: v with Chebyshev coefficients c falls with p and rises with F on the validity range
    if all g @ c >= 0. The condition is sufficient; on small `cells` in pressure and force it is
    nearly necessary."""

    def slopes(x: Array, degree: int) -> Array:
        return np.column_stack(
            [chebyshev.chebval(x, chebyshev.chebder(unit)) for unit in np.eye(degree + 1)]
        )

    by_pressure, by_force = slope_rows(
        chebyshev.chebvander, slopes, (pressure_degree, force_degree), cells
    )
    return np.vstack([-by_pressure, by_force])


MAX_CURVES = 5
POINTS = 161
"""Maximum number of pressures in the figure, and points of a curve (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ShapeConstrainedFit(Reported):
    """A shape-constrained surface and its error, with the error and the violations of the
    unconstrained surface.
    """

    model: ContractileSurface
    rmse: float
    """Root mean square error over the fitted rows [N]."""
    unconstrained: Fit
    unconstrained_violations: tuple[MonotonicityViolation, ...]
    """The regions where the unconstrained surface violates a rule."""
    free_points: int = 0
    """Number of points of free contraction."""

    @property
    def unconstrained_rmse(self) -> float:
        """Root mean square error without constraints [N]."""
        return self.unconstrained.rmse

    def chapter(self, fit: Fit | None = None) -> Chapter:
        """The description of the surface and the cost of its constraints. `fit` is the fit without
        constraints that the figure compares, such as one with weights; by default that of the same
        rows."""
        zero = (
            f", and it is zero at {self.free_points} points of free contraction"
            if self.free_points
            else ""
        )
        violations = self.unconstrained_violations
        compared = fit or self.unconstrained
        verdict = (
            "violates them in the regions of the table"
            if violations
            else "satisfies these constraints too"
        )
        title = "Monotonicity violations of the unconstrained surface"
        figure = partial(_surface_figure, self.model, compared)
        return Chapter(
            "shape",
            "Shape-constrained surface",
            summary=(
                (
                    f"Rms error {self.rmse:.4g} N with constraints, {self.unconstrained_rmse:.4g} N"
                    " without."
                ),
                (
                    "The muscle file contains the constrained surface: within its validity range"
                    " the force does not decrease with pressure and does not increase with"
                    f" contraction{zero}. The unconstrained surface {verdict}. The uncertainties"
                    " and bands are those of the unconstrained surface."
                ),
            ),
            values=(
                NamedValue("rms error", self.rmse, "N", brief=False),
                NamedValue(
                    "rms error without constraints", self.unconstrained_rmse, "N", brief=False
                ),
            ),
            tables=(violation_table(violations, "shape-loose", title),) if violations else (),
            plots=(Plot("shaped", "Solid: constrained. Dashed: unconstrained.", figure),),
            notes=tuple(f"unconstrained: {violation}" for violation in violations),
        )


def _surface_figure(shaped: ForceLaw, unconstrained: Fit) -> Any:
    figure, axes = new_figure(width=6.6, height=3.9)
    contraction = np.linspace(*unconstrained.data_ranges["contraction"], POINTS)
    for i, pressure in enumerate(levels_of(unconstrained.recording["pressure"], MAX_CURVES)):
        colour = LINES[i % len(LINES)]
        rows = np.full(POINTS, pressure)
        solid = {"label": f"{pressure / 1e3:.4g} kPa"}
        dashed = {"linestyle": DASHES[1]}
        for law, style in ((shaped, solid), (unconstrained.model, dashed)):
            force = law.force(rows, contraction)
            axes.plot(100 * contraction, force, color=colour, **style)
    axes.set(xlabel="contraction [%]", ylabel="force [N]")
    legend_outside(axes, title="gauge pressure")
    return figure


def fit_shape_constrained(
    law: ContractileSurface,
    recordings: Recording | Sequence[Recording],
    *,
    free: Recording | None = None,
    cells: tuple[int, int] = (6, 6),
) -> ShapeConstrainedFit:
    """Fit a surface by least squares with the constraint that its force never falls with p and
    never rises with eps. The constraint holds on the validity range of the data. `free` holds
    points (pressure, contraction) of free contraction, where the force is required to be zero. The
    slopes are enclosed on `cells` in pressure and contraction; more cells are slower and less
    conservative. The rows are those that are active in the unconstrained fit. Raises
    IdentificationError where no surface of this degree satisfies the constraints."""
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    # As censored rows the points of free contraction only extend the validity range.
    unconstrained = fit(
        law, runs if free is None else [*runs, free.with_columns(force=np.zeros(len(free)))]
    )
    surface = unconstrained.model
    assert isinstance(surface, ContractileSurface)
    active = unconstrained.problem.active_rows(unconstrained.problem.predict(unconstrained.values))
    data = unconstrained.recording.rows(active)
    target = unconstrained.problem.target[active]
    matrix = np.array(surface.basis(data["pressure"], data["contraction"])).T
    rows = shape_constraints(surface.degree, cells)
    basis = _free_contraction_basis(surface, free)
    scale = float(np.abs(target).max())
    minimum = MIN_SLOPE if free is None else 0.0
    scaled = basis @ solve_constrained_least_squares(
        matrix @ basis, target / scale, rows @ basis, minimum
    )
    model = dataclasses.replace(surface, coefficients=tuple((scale * scaled).tolist()))
    rmse = float(np.sqrt(np.mean((matrix @ (scale * scaled) - target) ** 2)))
    violations = find_shape_violations(surface, surface.validity_range)
    return ShapeConstrainedFit(
        model, rmse, unconstrained, violations, 0 if free is None else len(free)
    )


def _free_contraction_basis(law: ContractileSurface, free: Recording | None) -> Array:
    """A basis of the coefficients for which the force at the points of free contraction is zero
    (null space).
    """
    size = len(law.coefficients)
    if free is None or not len(free):
        return np.eye(size)
    conditions = np.array(law.basis(free["pressure"], free["contraction"])).T
    _, singular, vectors = np.linalg.svd(conditions)
    rank = int(np.count_nonzero(singular > 1e-10 * singular[0]))
    if rank >= size:
        raise IdentificationError(
            f"{free.origin}: {rank} points of free contraction determine all {size} coefficients."
            " Give fewer points, or choose a surface of a higher degree."
        )
    return np.asarray(vectors[rank:].T)


def shape_constraints(degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: a force surface keeps its shape on the validity range if all g @ coefficients >= 0;
    for `cells` in pressure and contraction."""

    def slopes(x: Array, degree: int) -> Array:
        return np.column_stack(
            [np.zeros(x.size), polynomial.polyvander(x, degree - 1) * np.arange(1, degree + 1)]
        )

    columns = [j * (degree + 1) + i for i, j in exponents(degree)]
    rises, falls = slope_rows(polynomial.polyvander, slopes, (degree, degree), cells)
    return np.vstack([rises[:, columns], -falls[:, columns]])
