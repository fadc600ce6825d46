"""Shape-constrained force surface: force never falls with pressure and never rises with contraction.

Both conditions are linear in the coefficients of a surface. They are imposed on the Bernstein coefficients of its
slopes on a few cells, which enclose the slopes, and therefore hold at every point of the validity range, not only on a
grid.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import polynomial

from ....core import Array, IdentificationError, ShortRepr, check_whole
from ....physics.muscle.characteristic import ContractileSurface, ForceLaw, ValidityRange, exponents
from ....recording import Recording
from ..result import Fit
from ..static_fit import fit
from . import monotonicity

_MIN_SLOPE = 1e-9
"""Minimum slope relative to the maximum force, on the validity range scaled to -1..1, so that rounding cannot change
the sign; chosen."""
LEAST_SHARE = 1e-3
"""Share of the validity range below which a region that violates the shape of a fitted law is not named (chosen)."""
FALLS_WITH_PRESSURE = monotonicity.MonotonicityRule("force falls with pressure", "force", 0, -1.0)
RISES_WITH_CONTRACTION = monotonicity.MonotonicityRule("force rises with contraction", "force", 1, 1.0)


def find_shape_violations(
    law: ForceLaw, validity_range: ValidityRange, *, points: int = 101
) -> tuple[monotonicity.MonotonicityViolation, ...]:
    """The regions of a validity range where a force falls with pressure or rises with contraction, largest first.

    Exact slopes are evaluated on an even grid of `points` pressures and contractions.
    """
    check_whole("find_shape_violations", "points", points, 2)
    sides = (np.linspace(*validity_range.pressure, points), np.linspace(*validity_range.contraction, points))
    return monotonicity.find_violations(
        law, (FALLS_WITH_PRESSURE, RISES_WITH_CONTRACTION), *np.meshgrid(*sides, indexing="ij")
    )


def shape_violations_of_fit(fit: Fit, *, points: int = 101) -> tuple[monotonicity.MonotonicityViolation, ...]:
    """The shape violations of a fitted law in the range of its data; none for laws that are no closed-form force."""
    law = fit.model
    varies = all(low < high for low, high in fit.data_ranges.values())
    if not isinstance(law, ForceLaw) or not law.traceable or not varies:
        return ()
    found = find_shape_violations(law, fit.validity_range, points=points)
    return tuple(each for each in found if each.area_fraction >= LEAST_SHARE)


@dataclasses.dataclass(frozen=True, repr=False)
class ShapeConstrainedFit(ShortRepr):
    """A shape-constrained surface and its error, with the error and the violations of the unconstrained surface."""

    model: ContractileSurface
    rmse: float
    """Root mean square error over the fitted rows [N]."""
    unconstrained_rmse: float
    """The same without constraints [N]."""
    unconstrained_violations: tuple[monotonicity.MonotonicityViolation, ...]
    """The regions where the unconstrained surface violates a rule."""


def fit_shape_constrained(
    law: ContractileSurface, recordings: Recording | Sequence[Recording], *, free: Recording | None = None,
    cells: tuple[int, int] = (6, 6),
) -> ShapeConstrainedFit:  # fmt: skip
    """Fit a surface by least squares with the constraint that its force never falls with p and never rises with eps.

    The constraint holds on the validity range of the data. `free` holds points (pressure, contraction) of free
    contraction, where the force is required to be zero. The slopes are enclosed on `cells` in pressure and contraction;
    more cells are slower and less conservative. The rows are those that are active in the unconstrained fit. Raises
    IdentificationError where no surface of this degree satisfies the constraints.
    """
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if free is not None:  # as censored rows they only extend the validity range
        runs.append(free.with_columns(force=np.zeros(len(free))))
    unconstrained = fit(law, runs)
    surface = unconstrained.model
    assert isinstance(surface, ContractileSurface)
    active = unconstrained.problem.active_rows(unconstrained.problem.predict(unconstrained.values))
    data, target = unconstrained.recording.rows(active), unconstrained.problem.target[active]
    matrix = np.array(surface.basis(data["pressure"], data["contraction"])).T
    rows, basis = shape_constraints(surface.degree, cells), _free_contraction_basis(surface, free)
    scale, minimum = float(np.abs(target).max()), _MIN_SLOPE if free is None else 0.0
    scaled = basis @ monotonicity.solve_constrained_least_squares(matrix @ basis, target / scale, rows @ basis, minimum)
    model = dataclasses.replace(surface, coefficients=tuple((scale * scaled).tolist()))
    rmse = float(np.sqrt(np.mean((matrix @ (scale * scaled) - target) ** 2)))
    violations = find_shape_violations(surface, surface.validity_range)
    return ShapeConstrainedFit(model, rmse, unconstrained.rmse, violations)


def _free_contraction_basis(law: ContractileSurface, free: Recording | None) -> Array:
    """A basis of the coefficients for which the force at the points of free contraction is zero (null space)."""
    size = len(law.coefficients)
    if free is None:
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
    """Rows g: the shape is kept on the validity range if all g @ coefficients >= 0.

    `cells` are the numbers of cells in pressure and in contraction.
    """
    columns = [j * (degree + 1) + i for i, j in exponents(degree)]
    rises, falls = monotonicity.slope_rows(polynomial.polyvander, _slopes, (degree, degree), cells)
    return np.vstack([rises[:, columns], -falls[:, columns]])


def _slopes(x: Array, degree: int) -> Array:
    """Slopes of 1, x, .. x^degree."""
    return np.column_stack([np.zeros(x.size), polynomial.polyvander(x, degree - 1) * np.arange(1, degree + 1)])
