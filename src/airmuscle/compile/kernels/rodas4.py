"""Rodas4: a Rosenbrock method of order four for stiff equations, adaptive, with dense output of order three.

Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section VI.4, method RODAS. Stiffly accurate,
L-stable, six stages with one factorisation. Inputs are linear within a segment; the method carries their slope,
without which it falls to order one. The end of a segment is met exactly.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numba

from ...core.status import Status
from .calls import invoke, pointer
from .rodas4_coefficients import (
    A21,
    A31,
    A32,
    A41,
    A42,
    A43,
    A51,
    A52,
    A53,
    A54,
    C21,
    C31,
    C32,
    C41,
    C42,
    C43,
    C51,
    C52,
    C53,
    C54,
    C61,
    C62,
    C63,
    C64,
    C65,
    D1,
    D2,
    D3,
    D4,
    GAMMA,
    H21,
    H22,
    H23,
    H24,
    H25,
    H31,
    H32,
    H33,
    H34,
    H35,
    N2,
    N3,
    N4,
)

DONE, PAUSED = Status.DONE.value, Status.PAUSED.value
STEP_TOO_SMALL, NOT_FINITE = Status.STEP_TOO_SMALL.value, Status.NOT_FINITE.value


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def rodas4(
    stage: Any, jac: Any, factor: Any, solve: Any, df_dt: Any, jacobian_size: Any, factor_size: Any,
    c: Any, y: Any, ends: Any, values: Any, slopes: Any, times: Any, rows: Any,
    relative: Any, absolute: Any, clock: Any, count: Any, budget: Any, work: Any,
) -> Any:  # fmt: skip
    """Advance `y` (n,) through the segments, and write the states at `times` into `rows`; a status code.

    stage .. df_dt  addresses of the printed functions; `c` what they need of the parameters
    ends, values, slopes  (S,), (S, m), (S, m): end of each segment, inputs at its start, their slopes
    clock  (3,): time, next step (0: to be found), start of the current segment
    count  (4,): segment, next row, steps, rejected steps
    budget  steps after which the kernel pauses, so that its caller can be interrupted; call again to go on
    work  (11 n + 2 m + jacobian_size + factor_size,): the caller owns it, because an array that a kernel makes
          and then knows by address alone is freed before its last use
    """
    n = y.shape[0]
    m = values.shape[1]
    f0, ft, x, yn, g = work[:n], work[n : 2 * n], work[2 * n : 3 * n], work[3 * n : 4 * n], work[4 * n : 5 * n]
    k1, k2, k3 = work[5 * n : 6 * n], work[6 * n : 7 * n], work[7 * n : 8 * n]
    k4, k5, k6 = work[8 * n : 9 * n], work[9 * n : 10 * n], work[10 * n : 11 * n]
    rest = 11 * n
    u, w = work[rest : rest + m], work[rest + m : rest + 2 * m]
    rest += 2 * m
    jacobian, factors = work[rest : rest + jacobian_size], work[rest + jacobian_size :]
    at_x, at_y, at_u, at_w, at_c = pointer(x), pointer(y), pointer(u), pointer(w), pointer(c)
    at_f, at_ft, at_j, at_a, at_g = pointer(f0), pointer(ft), pointer(jacobian), pointer(factors), pointer(g)
    at_1, at_2, at_3, at_4, at_5, at_6 = (
        pointer(k1), pointer(k2), pointer(k3), pointer(k4), pointer(k5), pointer(k6),
    )  # fmt: skip
    t, h, start = clock[0], clock[1], clock[2]
    segment, row = count[0], count[1]
    while row < times.shape[0] and times[row] <= t:
        for i in range(n):
            rows[row, i] = y[i]
        row += 1
    taken = 0
    status = DONE
    while segment < ends.shape[0]:
        end = ends[segment]
        moving = False
        for i in range(m):
            w[i] = slopes[segment, i]
            moving = moving or w[i] != 0.0
        for i in range(n):
            ft[i] = 0.0
        while t < end:
            if taken >= budget:
                status = PAUSED
                break
            for i in range(m):
                u[i] = values[segment, i] + (t - start) * w[i]
            invoke(jac, (at_y, at_u, at_c, at_f, at_j))
            if moving:
                invoke(df_dt, (at_y, at_u, at_c, at_w, at_ft))
            if h <= 0.0:
                size = 0.0
                rate = 0.0
                for i in range(n):
                    scale = absolute[i] + relative * abs(y[i])
                    size += (y[i] / scale) ** 2
                    rate += (f0[i] / scale) ** 2
                h = end - t
                if rate > 0.0:
                    h = min(h, 0.1 * sqrt(sqrt(relative)) * sqrt((size + 1.0) / rate))
            rejected = False
            while True:
                last = t + 1.000001 * h >= end
                if last:
                    h = end - t
                r = 1.0 / h
                invoke(factor, (at_j, r / GAMMA, at_a))
                for i in range(n):
                    g[i] = f0[i] + h * D1 * ft[i]
                invoke(solve, (at_a, at_g, at_1))
                if moving:
                    for i in range(m):
                        u[i] = values[segment, i] + (t + N2 * h - start) * w[i]
                for i in range(n):
                    x[i] = y[i] + A21 * k1[i]
                    g[i] = r * (C21 * k1[i]) + h * D2 * ft[i]
                invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_2))
                if moving:
                    for i in range(m):
                        u[i] = values[segment, i] + (t + N3 * h - start) * w[i]
                for i in range(n):
                    x[i] = y[i] + A31 * k1[i] + A32 * k2[i]
                    g[i] = r * (C31 * k1[i] + C32 * k2[i]) + h * D3 * ft[i]
                invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_3))
                if moving:
                    for i in range(m):
                        u[i] = values[segment, i] + (t + N4 * h - start) * w[i]
                for i in range(n):
                    x[i] = y[i] + A41 * k1[i] + A42 * k2[i] + A43 * k3[i]
                    g[i] = r * (C41 * k1[i] + C42 * k2[i] + C43 * k3[i]) + h * D4 * ft[i]
                invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_4))
                if moving:
                    for i in range(m):
                        u[i] = values[segment, i] + (t + h - start) * w[i]
                for i in range(n):
                    x[i] = y[i] + A51 * k1[i] + A52 * k2[i] + A53 * k3[i] + A54 * k4[i]
                    g[i] = r * (C51 * k1[i] + C52 * k2[i] + C53 * k3[i] + C54 * k4[i])
                invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_5))
                for i in range(n):
                    x[i] += k5[i]
                    g[i] = r * (C61 * k1[i] + C62 * k2[i] + C63 * k3[i] + C64 * k4[i] + C65 * k5[i])
                invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_6))
                error = 0.0
                for i in range(n):
                    yn[i] = x[i] + k6[i]
                    error += (k6[i] / (absolute[i] + relative * max(abs(y[i]), abs(yn[i])))) ** 2
                error = sqrt(error / n) + 1e-16
                if not error < 1e300:
                    factor_h = 0.5
                else:
                    factor_h = min(6.0, max(0.2, 0.9 / sqrt(sqrt(error))))
                    if error <= 1.0:
                        break
                rejected = True
                count[3] += 1
                h *= factor_h
                if h < 1e-14 * max(abs(t), end - start):
                    status = STEP_TOO_SMALL if error < 1e300 else NOT_FINITE
                    break
            if status != DONE:
                break
            reached = end if last else t + h
            if row < times.shape[0] and times[row] <= reached:
                for i in range(n):  # x and g are free by now: the two polynomials of the dense output
                    x[i] = H21 * k1[i] + H22 * k2[i] + H23 * k3[i] + H24 * k4[i] + H25 * k5[i]
                    g[i] = H31 * k1[i] + H32 * k2[i] + H33 * k3[i] + H34 * k4[i] + H35 * k5[i]
            while row < times.shape[0] and times[row] <= reached:
                q = (times[row] - t) / h
                p = 1.0 - q
                for i in range(n):
                    rows[row, i] = y[i] * p + q * (yn[i] + p * (x[i] + q * g[i]))
                row += 1
            for i in range(n):
                y[i] = yn[i]
            t = reached
            taken += 1
            h *= min(factor_h, 1.0) if rejected else factor_h
        if status != DONE:
            break
        segment += 1
        start = t
        h = 0.0
    clock[0], clock[1], clock[2] = t, h, start
    count[0], count[1] = segment, row
    count[2] += taken
    return status
