"""Gauss-Newton iteration from parameters that are already close to the optimum, as in refits to parts of the data.

The normal equations are formed in an orthonormal basis of the Jacobian at the start, in which they stay near the
identity. Reference: Björck, Numerical Methods for Least Squares Problems (1996), section 9.2.
"""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array
from .problem import FitProblem

_MAX_ITERATIONS = 25
_MAX_HALVINGS = 6
"""Maximum halvings of a step (chosen)."""
_RELATIVE_STEP = 1e-9
"""Step, in standard deviations of the residuals, at which the iteration ends (chosen)."""
_MIN_EIGENVALUE = 1e-6
"""Minimum eigenvalue of the normal matrix in the basis of the start (chosen)."""


def gauss_newton(problem: FitProblem, start: Array) -> tuple[Array, Array, Array] | None:
    """The parameters (P,) of least squares near `start`, with the fitted quantity (N,) and its Jacobian (N, P) there.

    None where the iteration is not certain: a bound, redundant parameters, a step that does not reduce the sum of
    squares, or slow convergence.
    """
    values, triangle = np.array(start, dtype=float), None
    modelled = problem.predict(values)
    for _ in range(_MAX_ITERATIONS):
        jacobian, residuals = problem.jacobian(values), problem.residuals(modelled)
        if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
            return None
        matrix = (problem.weights * problem.active_rows(modelled))[:, None] * jacobian
        if triangle is None:
            triangle = _basis(matrix)
        step = None if triangle is None else _step(matrix @ triangle, residuals)
        if step is None or triangle is None:
            return None
        sigma = np.linalg.norm(residuals) / np.sqrt(max(residuals.size - values.size, 1))
        if np.linalg.norm(step) <= _RELATIVE_STEP * sigma:
            return values, modelled, jacobian
        accepted = _shorten(problem, values, triangle @ step, float(residuals @ residuals))
        if accepted is None:
            return None
        values, modelled = accepted
    return None


def _shorten(problem: FitProblem, values: Array, step: Array, square: float) -> tuple[Array, Array] | None:
    """The parameters after the step, halved until they are within the bounds and the sum of squares does not increase,
    with the fitted quantity there."""
    low, high = problem.bounds
    for factor in 0.5 ** np.arange(_MAX_HALVINGS + 1):
        trial = values + factor * step
        if ((trial > low) & (trial < high)).all():
            modelled = problem.predict(trial)
            residuals = problem.residuals(modelled)
            if float(residuals @ residuals) <= square * (1 + 1e-12):
                return trial, modelled
    return None


def _basis(matrix: Array) -> Array | None:
    """The matrix that makes the columns orthonormal, shape (P, P); None for redundant columns."""
    norms = np.linalg.norm(matrix, axis=0)
    if matrix.shape[0] < matrix.shape[1] or not (norms > 0).all():
        return None
    triangle = np.linalg.qr(matrix / norms, mode="r")
    if np.linalg.svd(triangle, compute_uv=False)[-1] < 1e-9:
        return None
    return np.asarray(np.linalg.inv(triangle) / norms[:, None])


def _step(matrix: Array, residuals: Array) -> Array | None:
    """The step in the orthonormal basis, shape (P,); None where the normal matrix is nearly singular."""
    normal = matrix.T @ matrix
    if np.linalg.eigvalsh(normal)[0] < _MIN_EIGENVALUE:
        return None
    return np.asarray(-np.linalg.solve(normal, matrix.T @ residuals))
