"""Shape of static laws: regions with a slope of the wrong sign, and surfaces fitted without them.

A muscle cannot become shorter under more load, nor longer under more pressure; its force cannot fall with pressure, nor
rise with contraction. Both are linear in the coefficients of a force surface, and in those of v in the exponential
surface k = k_max (1 - exp v), which decreases with v. On an interval (cell) a polynomial lies between its minimum and
maximum Bernstein coefficient. Slopes whose Bernstein coefficients have the required sign on every cell therefore have
it everywhere, not only on a grid.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from ....core import Array, IdentificationError, ShortRepr, autodiff, check_whole
from ....physics.muscle.characteristic import ContractileSurface, ForceLaw, ValidityRange, exponents
from ....physics.muscle.characteristic.base import ContractionLaw
from ....recording import Recording
from ..result import Fit
from ..static_fit import fit
from ..variable_projection import shortened_step
from .exponential import LoadRange, SurfaceFit, SurfaceProblem

Columns = Callable[[Array, int], Any]
"""Values (N, degree + 1) at N points of the polynomials of a basis up to a degree, or of their slopes."""


def slope_rows(
    values: Columns, slopes: Columns, degrees: tuple[int, int], cells: tuple[int, int]
) -> tuple[Array, Array]:
    """Bernstein coefficients of the slopes of a surface by its first and by its second argument, on equal cells of
    -1..1, one column for each of its coefficients; the basis of each argument has these `values` and `slopes`."""
    pairs = list(zip(degrees, cells, strict=True))
    plain = [_bernstein_coefficients(values, degree, degree + 1, count) for degree, count in pairs]
    steep = [_bernstein_coefficients(slopes, degree, degree, count) for degree, count in pairs]
    return np.asarray(np.kron(steep[0], plain[1])), np.asarray(np.kron(plain[0], steep[1]))


def _bernstein_coefficients(columns: Columns, degree: int, size: int, cells: int) -> Array:
    """Bernstein coefficients, on equal cells of -1..1, of polynomials of degree below `size`, one column each."""
    if not size:  # the slopes of a constant
        return np.zeros((0, degree + 1))
    t = np.linspace(0.0, 1.0, size) if size > 1 else np.array([0.5])
    order = np.arange(size)
    binomials = np.array([math.comb(size - 1, int(j)) for j in order])
    bernstein = binomials * t[:, None] ** order * (1.0 - t[:, None]) ** (size - 1 - order)
    edges = itertools.pairwise(np.linspace(-1.0, 1.0, cells + 1))
    return np.vstack([np.linalg.solve(bernstein, columns(a + (b - a) * t, degree)) for a, b in edges])


def solve_constrained_least_squares(matrix: Array, right: Array, rows: Array, minimum: float) -> Array:
    """The x that minimises |matrix x - right| subject to rows x >= minimum.

    With matrix = Q R and z = R x - Q^T right it is the shortest z with rows R^-1 z >= minimum - rows R^-1 Q^T right,
    which Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23, reduce to non-negative least squares.
    Raises IdentificationError where no x satisfies the constraints.
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
        raise IdentificationError("no surface of this degree satisfies the shape constraints. Choose a higher degree.")
    return np.asarray(solve_triangular(r, -residual[:-1] / residual[-1] + unconstrained))


_ROUNDING, MIN_SLOPE = 1e-9, 1e-9
"""Slopes below this fraction of the maximum slope are rounding errors, and minimum slope of v, and of a force surface
by its maximum force, on the validity range scaled to -1..1, so that rounding cannot change the sign; chosen."""


@dataclasses.dataclass(frozen=True)
class MonotonicityRule:
    """A forbidden sign of the slope of the `quantity` that a law gives, with respect to one of its arguments."""

    description: str
    """A violation of the rule in words."""
    quantity: str
    argument: int
    """0 pressure, 1 the second argument."""
    sign: float
    """Sign of a slope that violates the rule."""


@dataclasses.dataclass(frozen=True)
class MonotonicityViolation:
    """One connected region of a validity range where a law violates a rule."""

    rule: MonotonicityRule
    pressure: tuple[float, float]
    """Limits of the region in gauge pressure [Pa]."""
    second_argument: tuple[float, float]
    """Limits of the region in contraction [1], or in force [N] for a law that gives contraction."""
    area_fraction: float
    """Fraction of the validity range that the region covers [1]."""
    worst_point: tuple[float, float]
    """Gauge pressure [Pa] and second argument at the maximum violation."""
    worst_slope: float
    """The slope there [SI]."""

    def __str__(self) -> str:
        (p0, p1), (low, high) = self.pressure, (self._format_second(v) for v in self.second_argument)
        share = f"{100 * self.area_fraction:.1f} %" if self.area_fraction >= 5e-4 else "less than 0.1 %"
        return (
            f"{self.rule.description} between {p0 / 1e3:.4g} and {p1 / 1e3:.4g} kPa, {low} and {high} "
            f"({share} of the validity range), most at {self.worst_point[0] / 1e3:.4g} kPa and "
            f"{self._format_second(self.worst_point[1])}"
        )

    def _format_second(self, value: float) -> str:
        return f"{100 * value:.2f} %" if self.rule.quantity == "force" else f"{value:.0f} N"


def find_violations(
    law: Any, rules: Sequence[MonotonicityRule], pressure: Array, second_argument: Array
) -> tuple[MonotonicityViolation, ...]:
    """The regions where exact slopes at grid points violate one of the rules, largest first. `pressure` [Pa] and
    `second_argument` (contraction [1] or force [N]) are grids, shape (N, M) each."""
    from scipy import ndimage

    violations: list[MonotonicityViolation] = []
    for rule in rules:
        slope = np.asarray(autodiff.derivative(law, rule.quantity, pressure, second_argument, wrt=rule.argument))
        excess = rule.sign * slope
        labels, count = ndimage.label((excess > 0.0) & (excess > _ROUNDING * np.abs(excess).max()))
        for inside in (labels == label for label in range(1, count + 1)):
            worst = np.unravel_index(int(np.argmax(np.where(inside, excess, -np.inf))), excess.shape)
            arguments = pressure, second_argument
            first, second = ((float(values[inside].min()), float(values[inside].max())) for values in arguments)
            point, share = (float(pressure[worst]), float(second_argument[worst])), float(inside.mean())
            violations.append(MonotonicityViolation(rule, first, second, share, point, float(slope[worst])))
    return tuple(sorted(violations, key=lambda v: -v.area_fraction))


RISES_WITH_FORCE = MonotonicityRule("contraction rises with force", "contraction", 1, 1.0)
CONTRACTION_FALLS = MonotonicityRule("contraction falls with pressure", "contraction", 0, -1.0)
RISES_WITH_CONTRACTION = MonotonicityRule("force rises with contraction", "force", 1, 1.0)
FORCE_FALLS = MonotonicityRule("force falls with pressure", "force", 0, -1.0)


def find_monotonicity_violations(
    law: ContractionLaw, validity_range: LoadRange | None = None, points: tuple[int, int] = (201, 201)
) -> tuple[MonotonicityViolation, ...]:
    """The regions of a validity range where k rises with F or falls with p, largest first. `validity_range` is by
    default that of the law. Exact slopes are evaluated on an even grid of `points` pressures and forces, edges
    included."""
    validity_range = validity_range or LoadRange.from_law(law)
    return find_violations(law, (RISES_WITH_FORCE, CONTRACTION_FALLS), *validity_range.grid(*points))


def fit_monotone(
    recording: Recording, saturation: float, *, pressure_degree: int = 4, force_degree: int = 2,
    cells: tuple[int, int] = (16, 12),
) -> SurfaceFit:  # fmt: skip
    """Fit k by least squares with the constraint that it never rises with F and never falls with p. The arguments are
    those of `fit_linearised`. The slopes are enclosed on `cells` in pressure and force; more cells are slower and less
    conservative. The method is Gauss-Newton; each step solves a least-squares problem with linear inequalities. Raises
    IdentificationError."""
    problem = SurfaceProblem.from_recording(recording, saturation, pressure_degree, force_degree)
    constraints = slope_constraints(pressure_degree, force_degree, cells)
    coefficients = solve_constrained_least_squares(*problem.linear_system(), constraints, MIN_SLOPE)

    def sum_of_squares(c: Array) -> float:
        residuals = problem.residuals(c)
        return float(residuals @ residuals)

    for _ in range(200):
        jacobian = problem.jacobian(coefficients)
        right = jacobian @ coefficients - problem.residuals(coefficients)
        step = solve_constrained_least_squares(jacobian, right, constraints, MIN_SLOPE) - coefficients
        # where no fraction of the step reduces the sum of squares, only rounding errors are left
        step = shortened_step(sum_of_squares, coefficients, step, sum_of_squares(coefficients), halvings=20)
        coefficients = coefficients + step
        if np.abs(step).max() < 1e-10:
            return problem.build_fit(coefficients, "nonlinear least squares, monotone on the validity range")
    raise IdentificationError(
        f"{recording.origin}: the monotone fit did not converge in 200 steps. Choose a lower degree or fewer cells."
    )


def slope_constraints(pressure_degree: int, force_degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: v with Chebyshev coefficients c falls with p and rises with F on the validity range if all g @ c >= 0.
    The condition is sufficient; on small `cells` in pressure and force it is nearly necessary."""

    def slopes(x: Array, degree: int) -> Array:
        return np.column_stack([chebyshev.chebval(x, chebyshev.chebder(unit)) for unit in np.eye(degree + 1)])

    by_pressure, by_force = slope_rows(chebyshev.chebvander, slopes, (pressure_degree, force_degree), cells)
    return np.vstack([-by_pressure, by_force])


LEAST_SHARE = 1e-3
"""Share of the validity range below which a region that violates the shape of a fitted law is not named (chosen)."""


def find_shape_violations(
    law: ForceLaw, validity_range: ValidityRange, *, points: int = 101
) -> tuple[MonotonicityViolation, ...]:
    """The regions of a validity range where a force falls with pressure or rises with contraction, largest first. Exact
    slopes are evaluated on an even grid of `points` pressures and contractions."""
    check_whole("find_shape_violations", "points", points, 2)
    sides = (np.linspace(*validity_range.pressure, points), np.linspace(*validity_range.contraction, points))
    return find_violations(law, (FORCE_FALLS, RISES_WITH_CONTRACTION), *np.meshgrid(*sides, indexing="ij"))


def shape_violations_of_fit(fit: Fit) -> tuple[MonotonicityViolation, ...]:
    """The shape violations of a fitted law in the range of its data; none for laws that are no closed-form force."""
    law, varies = fit.model, all(low < high for low, high in fit.data_ranges.values())
    if not isinstance(law, ForceLaw) or not law.traceable or not varies:
        return ()
    found = find_shape_violations(law, fit.validity_range)
    return tuple(each for each in found if each.area_fraction >= LEAST_SHARE)


@dataclasses.dataclass(frozen=True, repr=False)
class ShapeConstrainedFit(ShortRepr):
    """A shape-constrained surface and its error, with the error and the violations of the unconstrained surface."""

    model: ContractileSurface
    rmse: float
    """Root mean square error over the fitted rows [N]."""
    unconstrained_rmse: float
    """The same without constraints [N]."""
    unconstrained_violations: tuple[MonotonicityViolation, ...]
    """The regions where the unconstrained surface violates a rule."""


def fit_shape_constrained(
    law: ContractileSurface, recordings: Recording | Sequence[Recording], *, free: Recording | None = None,
    cells: tuple[int, int] = (6, 6),
) -> ShapeConstrainedFit:  # fmt: skip
    """Fit a surface by least squares with the constraint that its force never falls with p and never rises with eps.
    The constraint holds on the validity range of the data. `free` holds points (pressure, contraction) of free
    contraction, where the force is required to be zero. The slopes are enclosed on `cells` in pressure and contraction;
    more cells are slower and less conservative. The rows are those that are active in the unconstrained fit. Raises
    IdentificationError where no surface of this degree satisfies the constraints."""
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    # As censored rows the points of free contraction only extend the validity range.
    unconstrained = fit(law, runs if free is None else [*runs, free.with_columns(force=np.zeros(len(free)))])
    surface = unconstrained.model
    assert isinstance(surface, ContractileSurface)
    active = unconstrained.problem.active_rows(unconstrained.problem.predict(unconstrained.values))
    data, target = unconstrained.recording.rows(active), unconstrained.problem.target[active]
    matrix = np.array(surface.basis(data["pressure"], data["contraction"])).T
    rows, basis = shape_constraints(surface.degree, cells), _free_contraction_basis(surface, free)
    scale, minimum = float(np.abs(target).max()), MIN_SLOPE if free is None else 0.0
    scaled = basis @ solve_constrained_least_squares(matrix @ basis, target / scale, rows @ basis, minimum)
    model = dataclasses.replace(surface, coefficients=tuple((scale * scaled).tolist()))
    rmse = float(np.sqrt(np.mean((matrix @ (scale * scaled) - target) ** 2)))
    violations = find_shape_violations(surface, surface.validity_range)
    return ShapeConstrainedFit(model, rmse, unconstrained.rmse, violations)


def _free_contraction_basis(law: ContractileSurface, free: Recording | None) -> Array:
    """A basis of the coefficients for which the force at the points of free contraction is zero (null space)."""
    size = len(law.coefficients)
    if free is None or not len(free):
        return np.eye(size)
    conditions = np.array(law.basis(free["pressure"], free["contraction"])).T
    _, singular, vectors = np.linalg.svd(conditions)
    rank = int(np.count_nonzero(singular > 1e-10 * singular[0]))
    if rank >= size:
        raise IdentificationError(
            f"{free.origin}: {rank} points of free contraction determine all {size} coefficients. Give fewer points, "
            "or choose a surface of a higher degree."
        )
    return np.asarray(vectors[rank:].T)


def shape_constraints(degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: a force surface keeps its shape on the validity range if all g @ coefficients >= 0; for `cells` in
    pressure and contraction."""

    def slopes(x: Array, degree: int) -> Array:
        return np.column_stack([np.zeros(x.size), polynomial.polyvander(x, degree - 1) * np.arange(1, degree + 1)])

    columns = [j * (degree + 1) + i for i, j in exponents(degree)]
    rises, falls = slope_rows(polynomial.polyvander, slopes, (degree, degree), cells)
    return np.vstack([rises[:, columns], -falls[:, columns]])
