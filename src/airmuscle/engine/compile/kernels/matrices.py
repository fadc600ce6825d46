"""Small matrices as parts of kernels: products, factors, exponential Euler step with the Jacobian
and the rates.
"""

from math import sqrt

from ....core import Status
from .calls import PART, invoke, pointer

DONE = Status.DONE.value
NOT_FINITE = Status.NOT_FINITE.value
SINGULAR = Status.SINGULAR.value
MAX_NORM = 0.125
"""Norm of the matrix to which the Taylor polynomial is applied."""


@PART
def scaled_rates(f, a, sizes, h, m):
    """Write h (A, f) of the scaled states to `m` (n, N + 1); its 1-norm, infinite if it is not
    finite.
    """
    n = f.shape[0]
    total = sizes.shape[0]
    norm = 0.0
    for j in range(total + 1):
        size = sizes[j] if j < total else 1.0
        column = 0.0
        for i in range(n):
            value = h * (a[i, j] if j < total else f[i]) * size / sizes[i]
            m[i, j] = value
            column += abs(value)
        if not column < 1e300:
            column = 1e308
        norm = max(norm, column)
    return norm


@PART
def taylor_polynomial(m, share, square, cube, other, e):
    """The Taylor polynomial of order 8 of exp(share m) in `e`, by Paterson and Stockmeyer's
    scheme.
    """
    n, columns = m.shape
    for i in range(n):
        for j in range(columns):
            m[i, j] *= share
            square[i, j] = 0.0
            cube[i, j] = 0.0
    add_product(m, m, square)
    add_product(square, m, cube)
    for i in range(n):
        for j in range(columns):
            other[i, j] = m[i, j] / 5040.0 + square[i, j] / 40320.0
            e[i, j] = m[i, j] / 24.0 + square[i, j] / 120.0
        other[i, i] += 1.0 / 720.0
        e[i, i] += 1.0 / 6.0
    add_product(other, cube, e)
    for i in range(n):
        for j in range(columns):
            other[i, j] = m[i, j] + 0.5 * square[i, j]
        other[i, i] += 1.0
    add_product(e, cube, other)
    for i in range(n):
        for j in range(columns):
            e[i, j] = other[i, j]


@PART
def square_repeatedly(e, times, other):
    """Square the matrix whose first n rows are `e` (n, N + 1); the rows below are those of the
    identity.
    """
    n, columns = e.shape
    for _ in range(times):
        for i in range(n):
            for j in range(columns):
                other[i, j] = e[i, j] if j >= n else 0.0
        add_product(e, e, other)
        for i in range(n):
            for j in range(columns):
                e[i, j] = other[i, j]


@PART
def exponential_step(rates, c, sizes, x, u, h, f, a, m, square, cube, e, other):
    """Row k < n of `e` (n, N + 1): exp(A h) of the scaled states, and in its last column the
    increment of state k.

    rates(x, u, c, f, a)   its address: f (n,), a = df/dx (n, N); the N - n states at the end have
                           no rates
    m, square, cube, other (n, N + 1): workspace

    exp of the matrix ((h A, h f), (0, 0)), scaled by the magnitudes `sizes` (N,) of the states: a
    Taylor polynomial of a matrix whose norm was halved to less than 1/8, then squared.
    """
    invoke(rates, (pointer(x), pointer(u), pointer(c), pointer(f), pointer(a)))
    norm = scaled_rates(f, a, sizes, h, m)
    halvings = 0
    share = 1.0
    status = NOT_FINITE
    if norm < 1e300:
        while norm * share > MAX_NORM:
            share *= 0.5
            halvings += 1
        taylor_polynomial(m, share, square, cube, other, e)
        square_repeatedly(e, halvings, other)
        status = DONE
    return status


@PART
def multiply(a, b, result):
    """The product of `a` (n, k) and `b` (k, m) in `result` (n, m)."""
    for i in range(result.shape[0]):
        for j in range(result.shape[1]):
            value = 0.0
            for k in range(b.shape[0]):
                value += a[i, k] * b[k, j]
            result[i, j] = value


@PART
def add_product(a, b, result):
    """Add the product of the first n columns of `a` and of `b` (n, m) to `result` (n, m); zeros of
    `a` are skipped.
    """
    n = result.shape[0]
    for i in range(n):
        for k in range(n):
            if a[i, k] != 0.0:
                for j in range(result.shape[1]):
                    result[i, j] += a[i, k] * b[k, j]


@PART
def cholesky(s, factor):
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


@PART
def solve_factor(factor, count, x):
    """Replace the first `count` numbers of `x` by the solution of L L^T y = x with the factor L."""
    for i in range(count):
        for k in range(i):
            x[i] -= factor[i, k] * x[k]
        x[i] /= factor[i, i]
    for j in range(count):
        last = count - 1 - j
        for k in range(last + 1, count):
            x[last] -= factor[k, last] * x[k]
        x[last] /= factor[last, last]
