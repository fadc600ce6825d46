"""Least squares with inequality constraints on the slopes of a polynomial, enforced at every point of a range.

On an interval (cell) a polynomial lies between its minimum and maximum Bernstein coefficient. Slopes whose Bernstein
coefficients have the required sign on every cell therefore have it everywhere, not only on a grid.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from ....core.arrays import Array
from ....core.errors import IdentificationError


def bernstein_coefficients(columns: Callable[[Array], Array], size: int, cells: int) -> Array:
    """Bernstein coefficients, on equal cells of -1..1, of polynomials of degree below `size`, one column each.

    `columns` gives the values of the polynomials at N points, shape (N, polynomials).
    """
    t = np.linspace(0.0, 1.0, size) if size > 1 else np.array([0.5])
    order = np.arange(size)
    binomials = np.array([math.comb(size - 1, int(j)) for j in order])
    bernstein = binomials * t[:, None] ** order * (1.0 - t[:, None]) ** (size - 1 - order)
    edges = np.linspace(-1.0, 1.0, cells + 1)
    by_cell = [np.linalg.solve(bernstein, columns(a + (b - a) * t)) for a, b in itertools.pairwise(edges)]
    return np.asarray(np.vstack(by_cell))


def solve_constrained_least_squares(matrix: Array, right: Array, rows: Array, minimum: float) -> Array:
    """The x that minimises |matrix x - right| subject to rows x >= minimum.

    With matrix = Q R and z = R x - Q^T right it is the shortest z with rows R^-1 z >= minimum - rows R^-1 Q^T right,
    which Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23, reduce to non-negative least squares.
    Raises IdentificationError where no x satisfies the constraints.
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import nnls

    q, r = np.linalg.qr(matrix)
    inner = solve_triangular(r, rows.T, trans="T").T
    unconstrained = q.T @ right
    bound = minimum - inner @ unconstrained
    target = np.zeros(r.shape[0] + 1)
    target[-1] = 1.0
    dual, remainder = nnls(np.vstack([inner.T, bound]), target, maxiter=50 * len(rows))
    residual = np.vstack([inner.T, bound]) @ dual - target
    if remainder < 1e-12:
        raise IdentificationError("no surface of this degree satisfies the shape constraints. Choose a higher degree.")
    shortest = -residual[:-1] / residual[-1]
    return np.asarray(solve_triangular(r, shortest + unconstrained))
