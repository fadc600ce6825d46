"""Extended and unscented Kalman filters: prediction of the state with its covariance, correction by
measurements.
"""

from math import sqrt

import numba

from ....core import Status
from .calls import PART, invoke, pointer
from .matrices import cholesky, exponential_step, multiply, solve_factor

DONE = Status.DONE.value
SINGULAR = Status.SINGULAR.value
NOT_FINITE = Status.NOT_FINITE.value


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def predict_extended(rates, c, sizes, h, noise, x, u, covariance, transition, f, a, work, product):
    """Mean `x` (N,) and `covariance` (N, N) one sample later, in place, and `transition` (N, N).

    sizes   (N,) magnitudes of the states
    noise   (N, N) covariance of the process noise of a sample
    f, a    (n,), (n, N); work (5, n, N + 1), product (N, N): workspace
    """
    n = f.shape[0]
    total = x.shape[0]
    e = work[3]
    if (
        exponential_step(rates, c, sizes, x, u, h, f, a, work[0], work[1], work[2], e, work[4])
        != DONE
    ):
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
def apply_gain(gain, difference, x):
    """Add gain (N, p) times the innovation to the states."""
    for i in range(x.shape[0]):
        for k in range(difference.shape[0]):
            x[i] += gain[i, k] * difference[k]


@numba.njit(error_model="numpy", nogil=True)
def correct_extended(
    measured,
    constants,
    noise,
    x,
    u,
    covariance,
    values,
    difference,
    s,
    factor,
    c,
    gain,
    rest,
    product,
):
    """Mean `x` (N,) and `covariance` (N, N) after a measurement `values` (p,), in place.

    measured(x, u, c, y, C)  its address
    noise                    (p,) variances of the measurement
    difference, s            (p,), (p, p): the innovation and its covariance
    factor (p, p), c (p, N), gain (N, p), rest and product (N, N): workspace
    """
    total = x.shape[0]
    p = values.shape[0]
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
        solve_factor(factor, p, gain[k])
    for i in range(total):
        for j in range(total):
            value = 1.0 if i == j else 0.0
            for k in range(p):
                value -= gain[i, k] * c[k, j]
            rest[i, j] = value
    multiply(rest, covariance, product)
    for i in range(total):  # in Joseph's form: rest P rest^T + gain R gain^T
        for j in range(i + 1):
            value = 0.0
            for k in range(total):
                value += product[i, k] * rest[j, k]
            for k in range(p):
                value += gain[i, k] * noise[k] * gain[j, k]
            covariance[i, j] = value
            covariance[j, i] = value
    apply_gain(gain, difference, x)
    return DONE


@PART
def sigma_points(x, covariance, spread, points, root):
    """`points` (2 N + 1, N): x, then x +- spread times the columns of a Cholesky factor of the
    covariance.

    A state without variance gets a column of zeros; root (N, N) is workspace.
    """
    total = x.shape[0]
    for j in range(total):
        value = covariance[j, j]
        for k in range(j):
            value -= root[j, k] * root[j, k]
        pivot = sqrt(value) if value > 1e-14 * covariance[j, j] else 0.0
        root[j, j] = pivot
        for i in range(j + 1, total):
            value = covariance[i, j]
            for k in range(j):
                value -= root[i, k] * root[j, k]
            root[i, j] = value / pivot if pivot > 0.0 else 0.0
    for i in range(total):
        for k in range(2 * total + 1):
            points[k, i] = x[i]
        for j in range(i + 1):
            points[1 + j, i] += spread * root[i, j]
            points[1 + total + j, i] -= spread * root[i, j]


@PART
def weighted_mean(points, weights, mean):
    """The mean (N,) of points (2 N + 1, N)."""
    for i in range(mean.shape[0]):
        value = weights[0] * points[0, i]
        for q in range(1, points.shape[0]):
            value += weights[2] * points[q, i]
        mean[i] = value


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def predict_unscented(
    rates, c, sizes, h, spread, weights, noise, x, u, covariance, points, root, f, a, work
):
    """Mean `x` (N,) and `covariance` (N, N) one sample later, in place.

    sizes    (N,) magnitudes of the states
    weights  (3,): of the mean of the central point, of its covariance, of all other points
    points   (2 N + 1, N): the sigma points; root (N, N), f (n,), a (n, N), work (5, n, N + 1):
             workspace
    """
    n = f.shape[0]
    total = x.shape[0]
    sigma_points(x, covariance, spread, points, root)
    e = work[3]
    for q in range(points.shape[0]):
        point = points[q]
        if (
            exponential_step(
                rates, c, sizes, point, u, h, f, a, work[0], work[1], work[2], e, work[4]
            )
            != DONE
        ):
            return NOT_FINITE
        for i in range(n):
            point[i] += sizes[i] * e[i, total]
    weighted_mean(points, weights, x)
    for i in range(total):
        for j in range(i + 1):
            value = noise[i, j] + weights[1] * (points[0, i] - x[i]) * (points[0, j] - x[j])
            for q in range(1, points.shape[0]):
                value += weights[2] * (points[q, i] - x[i]) * (points[q, j] - x[j])
            covariance[i, j] = value
            covariance[j, i] = value
    return DONE


@numba.njit(error_model="numpy", nogil=True)
def correct_unscented(
    measured,
    constants,
    spread,
    weights,
    noise,
    x,
    u,
    covariance,
    values,
    difference,
    s,
    factor,
    points,
    root,
    y,
    c,
    gain,
    cross,
):
    """Mean `x` (N,) and `covariance` (N, N) after a measurement `values` (p,), in place.

    noise                    (p,) variances of the measurement
    difference, s            (p,), (p, p): the innovation and its covariance
    points (2 N + 1, N), y (2 N + 1, p), factor (p, p), root (N, N), c (p, N), gain and cross (N,
    p): workspace
    """
    total = x.shape[0]
    p = values.shape[0]
    sigma_points(x, covariance, spread, points, root)
    for q in range(points.shape[0]):
        invoke(
            measured,
            (pointer(points[q]), pointer(u), pointer(constants), pointer(y[q]), pointer(c)),
        )
    weighted_mean(y, weights, difference)
    for j in range(p):
        for i in range(p):
            value = noise[i] if i == j else 0.0
            for q in range(points.shape[0]):
                weight = weights[2] if q else weights[1]
                value += weight * (y[q, i] - difference[i]) * (y[q, j] - difference[j])
            s[i, j] = value
        for i in range(total):  # covariance of states and measurement
            value = 0.0
            for q in range(points.shape[0]):
                weight = weights[2] if q else weights[1]
                value += weight * (points[q, i] - x[i]) * (y[q, j] - difference[j])
            cross[i, j] = gain[i, j] = value
    if cholesky(s, factor) != DONE:
        return SINGULAR
    for i in range(total):
        solve_factor(factor, p, gain[i])
    for i in range(p):
        difference[i] = values[i] - difference[i]
    for i in range(total):
        for j in range(i + 1):
            value = covariance[i, j]
            for k in range(p):
                value -= gain[i, k] * cross[j, k]
            covariance[i, j] = value
            covariance[j, i] = value
    apply_gain(gain, difference, x)
    return DONE
