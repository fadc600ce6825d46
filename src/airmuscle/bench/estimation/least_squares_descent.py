"""Gauss-Newton iteration from parameters that are already close to the optimum, as in refits to
parts of the data.

The normal equations are formed in an orthonormal basis of the Jacobian at the start, in which they
stay near the identity. A parameter on a bound is held there while the descent direction points
outwards (projected Gauss-Newton). References: Björck, Numerical Methods for Least Squares Problems
(1996), section 9.2; Bertsekas, SIAM Journal on Control and Optimization 20:221 (1982).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from .problem import LeastSquaresProblem, LeastSquaresSolution

BoolArray = npt.NDArray[np.bool_]
RELATIVE_STEP = 1e-9
"""Step, in standard deviations of the residuals, at which the iteration ends (chosen)."""
MIN_EIGENVALUE = 1e-6
"""Minimum eigenvalue of the normal matrix in the basis of the start (chosen)."""
_MAX_ITERATIONS = 50
_MAX_REDUCTIONS = 20
"""Maximum reductions of the length of one step (chosen)."""
_REDUCTION = 0.5
"""Ratio of a reduced step to the one that increased the sum of squares (chosen)."""
_PROBE = 0.1
"""Fraction of the step at which the second derivative along it is estimated (reference: 0.1)."""


class StepBasis(NamedTuple):
    """The free parameters, mask (P,), and the matrix (P, F) from an orthonormal basis to steps of
    all parameters.
    """

    free: BoolArray
    directions: Array


class FirstStep(NamedTuple):
    """Known quantities at the start of an iteration: the basis, the first step in it (F,) and the
    sum of squares.
    """

    basis: StepBasis
    step: Array
    sum_of_squares: float


class _Point(NamedTuple):
    """Parameters (P,), the fitted quantity (N,) and the weighted residuals (N,) there."""

    values: Array
    modelled: Array
    residuals: Array

    @property
    def sum_of_squares(self) -> float:
        return float(self.residuals @ self.residuals)


class _Linearisation(NamedTuple):
    """The basis, the weighted Jacobian in it (N, F), the normal matrix (F, F) and the gradient
    (F,).
    """

    basis: StepBasis
    columns: Array
    normal: Array
    gradient: Array


def gauss_newton(
    problem: LeastSquaresProblem,
    start: Array,
    known: FirstStep | None = None,
    relative_step: float = RELATIVE_STEP,
) -> LeastSquaresSolution | None:
    """The solution of least squares near `start` (P,). None where the iteration is not certain:
    redundant parameters, a step that does not reduce the sum of squares, or slow convergence. With
    `known` the first step needs no Jacobian, and the last Jacobian is one step old."""
    point = _evaluate(problem, np.asarray(start, dtype=float))
    basis = None
    previous = 0.0
    fraction = 1.0
    if known is not None:
        basis = known.basis
        first = _evaluate(problem, point.values + basis.directions @ known.step)
        if first.sum_of_squares <= known.sum_of_squares:
            point = first
            previous = float(np.linalg.norm(known.step))
    for _ in range(_MAX_ITERATIONS):
        jacobian = problem.jacobian(point.values)
        if not (np.isfinite(point.residuals).all() and np.isfinite(jacobian).all()):
            return None
        linear = _linearise(problem, point, jacobian, basis)
        if linear is None:
            return None
        basis = linear.basis
        length = float(np.linalg.norm(np.linalg.solve(linear.normal, linear.gradient)))
        spare = max(point.residuals.size - point.values.size, 1)
        tolerance = float(
            np.linalg.norm(point.residuals) / np.sqrt(spare)
        )  # the standard deviation of the residuals
        if length <= RELATIVE_STEP * tolerance:
            return LeastSquaresSolution(point.values, point.modelled, jacobian)
        moved = _curved_step(problem, point, linear, min(2 * fraction, 1.0))
        if moved is None:
            return None
        point, fraction = moved
        ratio = min(length / previous, 1.0) if previous > 0 else 1.0
        if (
            fraction == 1
            and length * ratio <= relative_step * tolerance
            and relative_step > RELATIVE_STEP
        ):
            # The next step is smaller by the same ratio at least.
            return LeastSquaresSolution(point.values, point.modelled, jacobian)
        previous = length
    return None


def _evaluate(problem: LeastSquaresProblem, values: Array) -> _Point:
    """The point within the bounds that is closest to these parameters."""
    inside = np.clip(values, *problem.bounds)
    modelled = problem.predict(inside)
    return _Point(inside, modelled, problem.residuals(modelled))


def _linearise(
    problem: LeastSquaresProblem, point: _Point, jacobian: Array, basis: StepBasis | None
) -> _Linearisation | None:
    """The normal equations of the parameters that are not held on a bound; None for redundant
    parameters. A parameter on a bound is held where the gradient or the step of all free parameters
    points outwards: a step that the bound cuts off, along a narrow valley, would make no progress
    in the others."""
    matrix = (problem.weights * problem.active_rows(point.modelled))[:, None] * jacobian
    free = ~held_on_bounds(problem, point.values, matrix.T @ point.residuals)
    linear = _in_basis(matrix, point, free, basis)
    while linear is not None:
        step = -linear.basis.directions @ np.linalg.solve(linear.normal, linear.gradient)
        held = linear.basis.free & held_on_bounds(problem, point.values, -step)
        if not held.any() or np.array_equal(held, linear.basis.free):
            break
        linear = _in_basis(matrix, point, linear.basis.free & ~held, basis)
    return linear


def _in_basis(
    matrix: Array, point: _Point, free: BoolArray, basis: StepBasis | None
) -> _Linearisation | None:
    """The normal equations of the free parameters in the given basis, or in a new one where it is
    of other parameters or the normal matrix is nearly singular; None for redundant parameters."""
    for each in (basis if basis is not None and np.array_equal(free, basis.free) else None, None):
        current = orthonormal_basis(matrix, free) if each is None else each
        if current is None:
            return None
        columns = matrix @ current.directions
        normal = columns.T @ columns
        gradient = columns.T @ point.residuals
        if np.linalg.eigvalsh(normal)[0] >= MIN_EIGENVALUE:
            return _Linearisation(current, columns, normal, gradient)
    return None


def _curved_step(
    problem: LeastSquaresProblem, point: _Point, linear: _Linearisation, fraction: float
) -> tuple[_Point, float] | None:
    """The point after at most this fraction of a Gauss-Newton step with geodesic acceleration, and
    the fraction made. The acceleration follows the curved valley of correlated parameters; the
    fraction decreases until the sum of squares does not increase. The direction stays that of the
    full step: damping the normal matrix would damp the motion along the valley first. Reference:
    Transtrum and Sethna, arXiv:1201.5885 (2012)."""
    low, high = problem.bounds
    active = problem.weights * problem.active_rows(point.modelled)
    directions = linear.basis.directions
    inverse = np.asarray(np.linalg.inv(linear.normal), dtype=float)
    for _ in range(_MAX_REDUCTIONS):
        step, fixed = _bounded_step(
            -fraction * inverse @ linear.gradient,
            inverse,
            linear.basis,
            low - point.values,
            high - point.values,
        )
        ahead = problem.predict(np.clip(point.values + _PROBE * directions @ step, low, high))
        second = 2 / _PROBE * (active * (ahead - point.modelled) / _PROBE - linear.columns @ step)
        bend = fixed @ (-0.5 * inverse @ (linear.columns.T @ second))
        if np.isfinite(bend).all():
            trial = _evaluate(problem, point.values + directions @ (step + bend))
            if trial.sum_of_squares <= point.sum_of_squares * (1 + 1e-12):
                return trial, fraction
        fraction *= _REDUCTION
    return None


def _bounded_step(
    step: Array, inverse: Array, basis: StepBasis, low: Array, high: Array
) -> tuple[Array, Array]:
    """The step (F,) with the least square of which no parameter leaves its bounds, and the
    projection (F, F) onto the steps that keep the parameters on a bound there."""
    projection = np.eye(step.size)
    fixed = np.zeros(low.size, dtype=bool)
    bounded = step
    for _ in range(step.size):
        move = basis.directions @ bounded
        beyond = ((move < low) | (move > high)) & basis.free & ~fixed
        if not beyond.any() or np.count_nonzero(fixed | beyond) >= step.size:
            break
        fixed |= beyond
        rows = basis.directions[fixed]
        gain = inverse @ rows.T @ np.linalg.inv(rows @ inverse @ rows.T)
        bounded = step - gain @ (rows @ step - np.clip(rows @ step, low[fixed], high[fixed]))
        projection = np.eye(step.size) - gain @ rows
    return bounded, projection


def held_on_bounds(problem: LeastSquaresProblem, values: Array, gradient: Array) -> BoolArray:
    """Mask (P,) of the parameters on a bound that steps against the gradient would leave
    outwards.
    """
    with np.errstate(invalid="ignore"):
        low, high = problem.bounds_reached(values)
        return np.asarray((low & (gradient >= 0)) | (high & (gradient <= 0)))


def orthonormal_basis(matrix: Array, free: BoolArray) -> StepBasis | None:
    """The basis in which the free columns of a matrix (N, P) are orthonormal; None for redundant
    columns.
    """
    norms = np.linalg.norm(matrix[:, free], axis=0)
    if matrix.shape[0] < norms.size or not norms.size or not (norms > 0).all():
        return None
    triangle = np.linalg.qr(matrix[:, free] / norms, mode="r")
    if np.linalg.svd(triangle, compute_uv=False)[-1] < 1e-9:
        return None
    directions = np.zeros((free.size, norms.size))
    directions[free] = np.linalg.inv(triangle) / norms[:, None]
    return StepBasis(free, directions)


def normal_step(normal: Array, gradient: Array) -> Array | None:
    """The step in the orthonormal basis, shape (F,); None where the normal matrix is nearly
    singular.
    """
    if np.linalg.eigvalsh(normal)[0] < MIN_EIGENVALUE:
        return None
    return np.asarray(-np.linalg.solve(normal, gradient))
