"""Discretisation, and gains by the discrete algebraic Riccati equation."""

from __future__ import annotations

import numpy as np

from ...core.arrays import Array
from ...core.errors import ParameterError


def discretised(a: Array, b: Array, sample_time: float) -> tuple[Array, Array]:
    """State matrix (n, n) and input matrix (n, m) of the sampled plant with held inputs."""
    from scipy.linalg import expm

    n, m = b.shape
    both = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * sample_time)
    return both[:n, :n], both[:n, n:]


def regulator(owner: str, a: Array, b: Array, weights: Array, costs: Array, reason: str) -> tuple[Array, Array]:
    """Gain (m, n) of the linear-quadratic regulator, and the matrix (n, n) of its cost.

    Raises ParameterError that begins with `owner` and contains `reason`, where there is none.
    """
    from scipy.linalg import solve_discrete_are

    try:
        p = solve_discrete_are(a, b, weights, costs)
        gain = np.linalg.solve(costs + b.T @ p @ b, b.T @ p @ a)
    except np.linalg.LinAlgError:
        raise ParameterError(
            f"{owner}: these {reason} the plant, or a weight is missing. Give states a permitted deviation or a "
            "process noise, and measure or command more."
        ) from None
    return np.asarray(gain), np.asarray(p)


def observer_gain(owner: str, a: Array, c: Array, noise: Array, covariance: Array) -> Array:
    """Gain (n, p) of the stationary Kalman filter, which corrects a prediction by a measurement."""
    from scipy.linalg import solve_discrete_are

    try:
        p = solve_discrete_are(a.T, c.T, noise, covariance)
    except np.linalg.LinAlgError:
        raise ParameterError(
            f"{owner}: these measured columns do not detect all states, or a process noise is missing. Give the "
            "states a process noise, or measure more."
        ) from None
    return np.asarray(np.linalg.solve(c @ p @ c.T + covariance, c @ p).T)
