"""Extended Kalman filter: prediction by an exponential Euler step, and correction by measured columns."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numba

from ...core.status import Status
from .calls import invoke, pointer

DONE, SINGULAR, NOT_FINITE = Status.DONE.value, Status.SINGULAR.value, Status.NOT_FINITE.value


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True, inline="always")
def exponential_step(
    rates: Any,
    c: Any,
    sizes: Any,
    x: Any,
    u: Any,
    h: Any,
    f: Any,
    a: Any,
    m: Any,
    square: Any,
    cube: Any,
    e: Any,
    other: Any,
) -> Any:
    """Row k < n of `e` (n, N + 1): exp(A h) of the scaled states, and in its last column the increment of state k.

    rates(x, u, c, f, a)   its address: f (n,), a = df/dx (n, N); the N - n states at the end have no rates
    m, square, cube, other (n, N + 1): workspace

    exp of the matrix ((h A, h f), (0, 0)), scaled by the magnitudes `sizes` (N,) of the states: a Taylor polynomial of
    order 8 by Paterson and Stockmeyer's scheme, of a matrix whose norm was halved to less than 1/8, then squared.
    """
    n, total = f.shape[0], x.shape[0]
    invoke(rates, (pointer(x), pointer(u), pointer(c), pointer(f), pointer(a)))
    norm = 0.0
    for j in range(total + 1):
        size = sizes[j] if j < total else 1.0
        column = 0.0
        for i in range(n):
            value = h * (a[i, j] if j < total else f[i]) * size / sizes[i]
            m[i, j] = value
            column += abs(value)
        if not column < 1e300:
            return NOT_FINITE
        norm = max(norm, column)
    halvings = 0
    share = 1.0
    while norm * share > 0.125:
        share *= 0.5
        halvings += 1
    for i in range(n):
        for j in range(total + 1):
            m[i, j] *= share
            square[i, j] = 0.0
            cube[i, j] = 0.0
    for i in range(n):
        for k in range(n):
            if m[i, k] != 0.0:
                for j in range(total + 1):
                    square[i, j] += m[i, k] * m[k, j]
    for i in range(n):
        for k in range(n):
            if square[i, k] != 0.0:
                for j in range(total + 1):
                    cube[i, j] += square[i, k] * m[k, j]
    for i in range(n):
        for j in range(total + 1):
            other[i, j] = m[i, j] / 5040.0 + square[i, j] / 40320.0
            e[i, j] = m[i, j] / 24.0 + square[i, j] / 120.0
        other[i, i] += 1.0 / 720.0
        e[i, i] += 1.0 / 6.0
    for i in range(n):
        for k in range(n):
            if other[i, k] != 0.0:
                for j in range(total + 1):
                    e[i, j] += other[i, k] * cube[k, j]
    for i in range(n):
        for j in range(total + 1):
            other[i, j] = m[i, j] + 0.5 * square[i, j]
        other[i, i] += 1.0
    for i in range(n):
        for k in range(n):
            if e[i, k] != 0.0:
                for j in range(total + 1):
                    other[i, j] += e[i, k] * cube[k, j]
    for i in range(n):
        for j in range(total + 1):
            e[i, j] = other[i, j]
    for _ in range(halvings):
        for i in range(n):
            for j in range(total + 1):
                other[i, j] = e[i, j] if j >= n else 0.0  # the rows below are those of the identity
            for k in range(n):
                if e[i, k] != 0.0:
                    for j in range(total + 1):
                        other[i, j] += e[i, k] * e[k, j]
        for i in range(n):
            for j in range(total + 1):
                e[i, j] = other[i, j]
    return DONE


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
    for i in range(total):
        for j in range(total):
            value = 0.0
            for k in range(total):
                value += transition[i, k] * covariance[k, j]
            product[i, j] = value
    for i in range(total):
        for j in range(i + 1):
            value = noise[i, j]
            for k in range(total):
                value += product[i, k] * transition[j, k]
            covariance[i, j] = value
            covariance[j, i] = value
    return DONE


@numba.njit(error_model="numpy", nogil=True, inline="always")
def cholesky(s: Any, factor: Any) -> Any:
    """Lower triangular `factor` (p, p) of a positive definite matrix `s`; a status."""
    for i in range(s.shape[0]):
        for j in range(i + 1):
            value = s[i, j]
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = value / factor[j, j]
            elif value > 0.0:
                factor[i, i] = sqrt(value)
            else:
                return SINGULAR
    return DONE


@numba.njit(error_model="numpy", nogil=True, inline="always")
def solve_row(factor: Any, row: Any) -> None:
    """Replace `row` (p,) by S^-1 row, where S = L L^T with the factor L."""
    p = factor.shape[0]
    for i in range(p):
        for k in range(i):
            row[i] -= factor[i, k] * row[k]
        row[i] /= factor[i, i]
    for i in range(p - 1, -1, -1):
        for k in range(i + 1, p):
            row[i] -= factor[k, i] * row[k]
        row[i] /= factor[i, i]


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
    for k in range(total):
        for i in range(p):
            value = 0.0
            for j in range(total):
                value += covariance[k, j] * c[i, j]
            gain[k, i] = value
    for i in range(p):
        for j in range(p):
            value = noise[i] if i == j else 0.0
            for k in range(total):
                value += c[i, k] * gain[k, j]
            s[i, j] = value
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
    for i in range(total):
        for j in range(total):
            value = 0.0
            for k in range(total):
                value += rest[i, k] * covariance[k, j]
            product[i, j] = value
    for i in range(total):
        for j in range(i + 1):
            value = 0.0
            for k in range(total):
                value += product[i, k] * rest[j, k]
            for k in range(p):
                value += gain[i, k] * noise[k] * gain[j, k]
            covariance[i, j] = value
            covariance[j, i] = value
        for k in range(p):
            x[i] += gain[i, k] * difference[k]
    return DONE
