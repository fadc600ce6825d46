"""Gauss-Legendre quadrature whose nodes are graded towards an end with a square-root singularity."""

from __future__ import annotations

import functools

import numpy as np

from ....core.arrays import Array


@functools.cache
def graded_quadrature(nodes: int) -> tuple[Array, Array]:
    """Nodes v and weights, shape (nodes,) each, for integrals over 0 <= v <= 1 with a factor like 1/sqrt(1 - v).

    The nodes are Gauss points y in v = y (2 - y), so that 1 - v = (1 - y)^2 removes the singularity at v = 1. The
    integral is sum(weights f(nodes)).
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    y = (points + 1) / 2
    return y * (2 - y), weights * (1 - y)
