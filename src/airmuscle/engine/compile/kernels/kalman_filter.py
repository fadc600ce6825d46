"""Extended Kalman filter: prediction by an exponential Euler step, and correction by measured columns."""

from __future__ import annotations

from typing import Any

import numba

from ....core.diagnostics import Status
from .calls import invoke, pointer
from .exponential import exponential_step
from .matrices import cholesky, multiply, solve_row
from .parts import PART

DONE, SINGULAR, NOT_FINITE = Status.DONE.value, Status.SINGULAR.value, Status.NOT_FINITE.value


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def predict_extended(
    rates: Any, c: Any, sizes: Any, h: Any, noise: Any, x: Any, u: Any, covariance: Any, transition: Any, f: Any,
    a: Any, work: Any, product: Any,
) -> Any:  # fmt: skip
    """Mean `x` (N,) and `covariance` (N, N) one sample later, in place, and `transition` (N, N).

    sizes   (N,) magnitudes of the states
    noise   (N, N) covariance of the process noise of a sample
    f, a    (n,), (n, N); work (5, n, N + 1), product (N, N): workspace
    """
    n, total = f.shape[0], x.shape[0]
    e = work[3]
    if exponential_step(rates, c, sizes, x, u, h, f, a, work[0], work[1], work[2], e, work[4]) != DONE:
        return NOT_FINITE
    for i in range(total):
        for j in range(total):
            transition[i, j] = 1.0 if i == j else 0.0
    for i in range(n):
        for j in range(total):
            transition[i, j] = e[i, j] * sizes[i] / sizes[j]
    for i in range(n):
        x[i] += sizes[i] * e[i, total]
    multiply(transition, covariance, product)
    for i in range(total):
        for j in range(i + 1):
            value = noise[i, j]
            for k in range(total):
                value += product[i, k] * transition[j, k]
            covariance[i, j] = value
            covariance[j, i] = value
    return DONE


@PART
def update_covariance(rest: Any, product: Any, gain: Any, noise: Any, covariance: Any) -> None:
    """The covariance after a measurement in Joseph's form: rest P rest^T + gain R gain^T; product = rest P."""
    total, p = gain.shape
    for i in range(total):
        for j in range(i + 1):
            value = 0.0
            for k in range(total):
                value += product[i, k] * rest[j, k]
            for k in range(p):
                value += gain[i, k] * noise[k] * gain[j, k]
            covariance[i, j] = value
            covariance[j, i] = value


@PART
def apply_gain(gain: Any, difference: Any, x: Any) -> None:
    """Add gain (N, p) times the innovation to the states."""
    for i in range(x.shape[0]):
        for k in range(difference.shape[0]):
            x[i] += gain[i, k] * difference[k]


@numba.njit(error_model="numpy", nogil=True)
def correct_extended(
    measured: Any, constants: Any, noise: Any, x: Any, u: Any, covariance: Any, values: Any, difference: Any, s: Any,
    factor: Any, c: Any, gain: Any, rest: Any, product: Any,
) -> Any:  # fmt: skip
    """Mean `x` (N,) and `covariance` (N, N) after a measurement `values` (p,), in place.

    measured(x, u, c, y, C)  its address
    noise                    (p,) variances of the measurement
    difference, s            (p,), (p, p): the innovation and its covariance
    factor (p, p), c (p, N), gain (N, p), rest and product (N, N): workspace
    """
    total, p = x.shape[0], values.shape[0]
    invoke(measured, (pointer(x), pointer(u), pointer(constants), pointer(difference), pointer(c)))
    for i in range(p):
        difference[i] = values[i] - difference[i]
    multiply(covariance, c.T, gain)
    multiply(c, gain, s)
    for i in range(p):
        s[i, i] += noise[i]
    if cholesky(s, factor) != DONE:
        return SINGULAR
    for k in range(total):
        solve_row(factor, gain[k])
    for i in range(total):
        for j in range(total):
            value = 1.0 if i == j else 0.0
            for k in range(p):
                value -= gain[i, k] * c[k, j]
            rest[i, j] = value
    multiply(rest, covariance, product)
    update_covariance(rest, product, gain, noise, covariance)
    apply_gain(gain, difference, x)
    return DONE
