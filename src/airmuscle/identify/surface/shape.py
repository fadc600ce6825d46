"""A force surface that a muscle can have: force not falling with pressure, nor rising with contraction.

Both are linear in the coefficients of a surface. Written for the Bernstein coefficients of its slopes on a few
cells, which enclose the slopes, the inequalities hold at every point of the validity range and not on a grid alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import polynomial

from ...characteristic.base import ForceLaw
from ...characteristic.contractile_surface import ContractileSurface, exponents
from ...characteristic.validity_range import ValidityRange
from ...core.arrays import Array
from ...core.errors import IdentificationError
from ...recording import Recording
from ..result import Fit
from ..static_fit import fit
from .bernstein import bernstein_coefficients, solve_constrained_least_squares
from .monotonicity import MonotonicityRule, MonotonicityViolation, find_violations

_MIN_SLOPE = 1e-9
"""Least slope on the validity range scaled to -1..1, in parts of the greatest force, so that rounding turns none round; chosen."""
FALLS_WITH_PRESSURE = MonotonicityRule("force falls with pressure", "force", 0, -1.0)
RISES_WITH_CONTRACTION = MonotonicityRule("force rises with contraction", "force", 1, 1.0)


def find_shape_violations(
    law: ForceLaw, validity_range: ValidityRange, *, points: int = 101
) -> tuple[MonotonicityViolation, ...]:
    """The places of a validity range where a muscle's force falls with pressure or rises with contraction, largest first."""
    sides = (np.linspace(*validity_range.pressure, points), np.linspace(*validity_range.contraction, points))
    return find_violations(law, (FALLS_WITH_PRESSURE, RISES_WITH_CONTRACTION), *np.meshgrid(*sides, indexing="ij"))


def shape_violations_of_fit(fit: Fit, *, points: int = 101) -> tuple[MonotonicityViolation, ...]:
    """The places in the data's validity range where a fitted law breaks a rule; none for laws that are no closed-form force."""
    law = fit.model
    if (
        not isinstance(law, ForceLaw)
        or not law.traceable
        or not all(low < high for low, high in fit.data_ranges.values())
    ):
        return ()
    return find_shape_violations(law, fit.validity_range, points=points)


@dataclasses.dataclass(frozen=True)
class ShapeConstrainedFit:
    """A surface that keeps its shape, its error, and that of the surface without conditions."""

    model: ContractileSurface
    rmse: float
    """Root mean square error over the fitted rows [N]."""
    unconstrained_rmse: float
    """The same without conditions [N]: what they cost is the difference."""
    unconstrained_violations: tuple[MonotonicityViolation, ...]
    """Where the surface without conditions breaks a rule."""


def fit_shape_constrained(
    surface: ContractileSurface,
    recording: Recording | Sequence[Recording],
    *,
    free: Recording | None = None,
    cells: tuple[int, int] = (6, 6),
) -> ShapeConstrainedFit:
    """Fit a surface by least squares among those whose force never falls with p nor rises with eps on the validity range.

    `free` holds points (pressure, contraction) at which the muscle hangs free: there the force is made zero. The
    slopes are enclosed on `cells` parts of the validity range in pressure and contraction; more of them cost time and lose less.
    Rows that the fit without conditions counts are counted. Raises IdentificationError where no surface can be so.
    """
    runs = [recording] if isinstance(recording, Recording) else list(recording)
    if free is not None:  # as slack points they only widen the validity range
        runs.append(free.with_columns(force=np.zeros(len(free))))
    loose = fit(surface, runs)
    law = loose.model
    assert isinstance(law, ContractileSurface)
    counting = loose.problem.active_rows(loose.problem.predict(loose.values))
    data = loose.recording.rows(counting)
    matrix = np.array(law.basis(data["pressure"], data["contraction"])).T
    goal = loose.problem.target[counting]
    rows = shape_constraints(law.degree, cells)
    scale = float(np.abs(goal).max())
    basis = _free_contraction_basis(law, free)
    found = basis @ solve_constrained_least_squares(
        matrix @ basis, goal / scale, rows @ basis, _MIN_SLOPE if free is None else 0.0
    )
    model = dataclasses.replace(law, coefficients=tuple(float(a) for a in scale * found))
    errors = matrix @ (scale * found) - goal
    return ShapeConstrainedFit(
        model, float(np.sqrt(np.mean(errors**2))), loose.rmse, find_shape_violations(law, law.validity_range)
    )


def _free_contraction_basis(law: ContractileSurface, free: Recording | None) -> Array:
    """A basis of the coefficients whose force at the free points is zero."""
    size = len(law.coefficients)
    if free is None:
        return np.eye(size)
    conditions = np.array(law.basis(free["pressure"], free["contraction"])).T
    _, singular, directions = np.linalg.svd(conditions)
    rank = int(np.count_nonzero(singular > 1e-10 * singular[0]))
    if rank >= size:
        raise IdentificationError(
            f"{free.origin}: {rank} conditions at free points leave none of {size} coefficients open. Give fewer "
            "points, or a surface of a higher degree."
        )
    return np.asarray(directions[rank:].T)


def shape_constraints(degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: a surface keeps its shape on the validity range if all g @ coefficients >= 0; `cells` by pressure, contraction."""
    chosen = [j * (degree + 1) + i for i, j in exponents(degree)]
    rises = np.kron(_bernstein_matrix(degree, cells[0], slope=True), _bernstein_matrix(degree, cells[1], slope=False))
    falls = -np.kron(_bernstein_matrix(degree, cells[0], slope=False), _bernstein_matrix(degree, cells[1], slope=True))
    return np.vstack([rises[:, chosen], falls[:, chosen]])


def _bernstein_matrix(degree: int, cells: int, *, slope: bool) -> Array:
    """Bernstein coefficients, on even cells of -1..1, of 1, x, .. x^degree or their slopes, one column each."""
    if not slope:
        return bernstein_coefficients(lambda x: np.asarray(polynomial.polyvander(x, degree)), degree + 1, cells)
    powers = np.arange(1, degree + 1)

    def slopes(x: Array) -> Array:
        return np.column_stack([np.zeros(x.size), polynomial.polyvander(x, degree - 1) * powers])

    return bernstein_coefficients(slopes, degree, cells)
