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
from .parts import CONTRACTED_PART
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
from .segments import set_inputs, write_present

DONE, PAUSED = Status.DONE.value, Status.PAUSED.value
STEP_TOO_SMALL, NOT_FINITE = Status.STEP_TOO_SMALL.value, Status.NOT_FINITE.value


@CONTRACTED_PART
def workspace(work: Any, n: Any, m: Any, jacobian_size: Any) -> Any:
    """The arrays f0, ft, x, yn, g, k1 .. k6 (n,), u, w (m,), Jacobian and factors within the workspace."""
    rest = 11 * n + 2 * m
    return (
        work[:n], work[n : 2 * n], work[2 * n : 3 * n], work[3 * n : 4 * n], work[4 * n : 5 * n],
        (work[5 * n : 6 * n], work[6 * n : 7 * n], work[7 * n : 8 * n],
         work[8 * n : 9 * n], work[9 * n : 10 * n], work[10 * n : 11 * n]),
        work[11 * n : 11 * n + m], work[11 * n + m : rest],
        work[rest : rest + jacobian_size], work[rest + jacobian_size :],
    )  # fmt: skip


@CONTRACTED_PART
def begin_segment(slopes: Any, segment: Any, w: Any, ft: Any) -> Any:
    """Set the slopes `w` of the inputs and the derivative `ft` with respect to time; whether an input changes."""
    moving = False
    for i in range(w.shape[0]):
        w[i] = slopes[segment, i]
        moving = moving or w[i] != 0.0
    for i in range(ft.shape[0]):
        ft[i] = 0.0
    return moving


@CONTRACTED_PART
def differentiate(jac: Any, df_dt: Any, moving: Any, y: Any, at: Any, at_j: Any, w: Any, f0: Any, ft: Any) -> None:
    """Rates and Jacobian at `y`, and their derivative with respect to time where an input changes."""
    _, at_u, at_c, _, _ = at
    invoke(jac, (pointer(y), at_u, at_c, pointer(f0), at_j))
    if moving:
        invoke(df_dt, (pointer(y), at_u, at_c, pointer(w), pointer(ft)))


@CONTRACTED_PART
def initial_step(y: Any, f0: Any, relative: Any, absolute: Any, left: Any) -> Any:
    """The first step of a segment, from the sizes of states and rates; at most `left`."""
    size = 0.0
    rate = 0.0
    for i in range(y.shape[0]):
        scale = absolute[i] + relative * abs(y[i])
        size += (y[i] / scale) ** 2
        rate += (f0[i] / scale) ** 2
    h = left
    if rate > 0.0:
        h = min(h, 0.1 * sqrt(sqrt(relative)) * sqrt((size + 1.0) / rate))
    return h


@CONTRACTED_PART
def compute_stages(
    solve: Any, stage: Any, at: Any, at_k: Any, k: Any, y: Any, x: Any, g: Any, f0: Any, ft: Any,
    values: Any, segment: Any, w: Any, u: Any, t: Any, start: Any, h: Any, moving: Any,
) -> None:  # fmt: skip
    """Stages one to four of a step from `t`; at  (x, u, c, factors, g), at_k  (k1 .. k6): addresses."""
    k1, k2, k3, n, r = k[0], k[1], k[2], y.shape[0], 1.0 / h
    at_x, at_u, at_c, at_a, at_g = at
    for i in range(n):
        g[i] = f0[i] + h * D1 * ft[i]
    invoke(solve, (at_a, at_g, at_k[0]))
    if moving:
        set_inputs(values, segment, t + N2 * h - start, w, u)
    for i in range(n):
        x[i] = y[i] + A21 * k1[i]
        g[i] = r * (C21 * k1[i]) + h * D2 * ft[i]
    invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_k[1]))
    if moving:
        set_inputs(values, segment, t + N3 * h - start, w, u)
    for i in range(n):
        x[i] = y[i] + A31 * k1[i] + A32 * k2[i]
        g[i] = r * (C31 * k1[i] + C32 * k2[i]) + h * D3 * ft[i]
    invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_k[2]))
    if moving:
        set_inputs(values, segment, t + N4 * h - start, w, u)
    for i in range(n):
        x[i] = y[i] + A41 * k1[i] + A42 * k2[i] + A43 * k3[i]
        g[i] = r * (C41 * k1[i] + C42 * k2[i] + C43 * k3[i]) + h * D4 * ft[i]
    invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_k[3]))
    if moving:
        set_inputs(values, segment, t + h - start, w, u)


@CONTRACTED_PART
def compute_last_stages(stage: Any, at: Any, at_k: Any, k: Any, y: Any, x: Any, g: Any, h: Any) -> None:
    """Stages five and six, at the end of the step."""
    k1, k2, k3, k4, k5, n, r = k[0], k[1], k[2], k[3], k[4], y.shape[0], 1.0 / h
    at_x, at_u, at_c, at_a, at_g = at
    for i in range(n):
        x[i] = y[i] + A51 * k1[i] + A52 * k2[i] + A53 * k3[i] + A54 * k4[i]
        g[i] = r * (C51 * k1[i] + C52 * k2[i] + C53 * k3[i] + C54 * k4[i])
    invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_k[4]))
    for i in range(n):
        x[i] += k5[i]
        g[i] = r * (C61 * k1[i] + C62 * k2[i] + C63 * k3[i] + C64 * k4[i] + C65 * k5[i])
    invoke(stage, (at_x, at_u, at_c, at_a, at_g, at_k[5]))


@CONTRACTED_PART
def finish_step(y: Any, x: Any, k6: Any, relative: Any, absolute: Any, yn: Any) -> Any:
    """The states `yn` at the end of the step; its error in tolerances, rms over the states."""
    error = 0.0
    for i in range(y.shape[0]):
        yn[i] = x[i] + k6[i]
        error += (k6[i] / (absolute[i] + relative * max(abs(y[i]), abs(yn[i])))) ** 2
    return sqrt(error / y.shape[0]) + 1e-16


@CONTRACTED_PART
def step_factor(error: Any) -> Any:
    """The ratio of the next step to this one."""
    factor = 0.5
    if error < 1e300:
        factor = min(6.0, max(0.2, 0.9 / sqrt(sqrt(error))))
    return factor


@CONTRACTED_PART
def accepted_step(
    factor: Any, solve: Any, stage: Any, at: Any, at_k: Any, at_j: Any, k: Any, y: Any, x: Any, g: Any, f0: Any,
    ft: Any, yn: Any, values: Any, segment: Any, w: Any, u: Any, t: Any, start: Any, end: Any, h: Any, moving: Any,
    relative: Any, absolute: Any,
) -> Any:  # fmt: skip
    """Try steps, beginning with `h`, until one is accepted, which leads to the states `yn`.

    Returns a status, the step, the ratio of the next step to it, whether it meets `end`, and the rejected steps.
    """
    status, rejections = DONE, 0
    while True:
        last = t + 1.000001 * h >= end
        if last:
            h = end - t
        invoke(factor, (at_j, (1.0 / h) / GAMMA, at[3]))
        compute_stages(solve, stage, at, at_k, k, y, x, g, f0, ft, values, segment, w, u, t, start, h, moving)
        compute_last_stages(stage, at, at_k, k, y, x, g, h)
        error = finish_step(y, x, k[5], relative, absolute, yn)
        ratio = step_factor(error)
        if error <= 1.0:
            break
        rejections += 1
        h *= ratio
        if h < 1e-14 * max(abs(t), end - start):
            status = STEP_TOO_SMALL if error < 1e300 else NOT_FINITE
            break
    return status, h, ratio, last, rejections


@CONTRACTED_PART
def complete_step(
    times: Any, row: Any, reached: Any, t: Any, h: Any, y: Any, yn: Any, k: Any, x: Any, g: Any, rows: Any
) -> Any:
    """Write the states at the output times up to `reached` by the dense output, then copy `yn` to `y`; the next row."""
    k1, k2, k3, k4, k5, n = k[0], k[1], k[2], k[3], k[4], y.shape[0]
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
    return row


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
    f0, ft, x, yn, g, k, u, w, jacobian, factors = workspace(work, n, values.shape[1], jacobian_size)
    at, at_j = (pointer(x), pointer(u), pointer(c), pointer(factors), pointer(g)), pointer(jacobian)
    at_k = (pointer(k[0]), pointer(k[1]), pointer(k[2]), pointer(k[3]), pointer(k[4]), pointer(k[5]))
    t, h, start = clock[0], clock[1], clock[2]
    segment, taken, status = count[0], 0, DONE
    row = write_present(times, count[1], t, y, rows)
    while segment < ends.shape[0]:
        end = ends[segment]
        moving = begin_segment(slopes, segment, w, ft)
        while t < end:
            if taken >= budget:
                status = PAUSED
                break
            set_inputs(values, segment, t - start, w, u)
            differentiate(jac, df_dt, moving, y, at, at_j, w, f0, ft)
            if h <= 0.0:
                h = initial_step(y, f0, relative, absolute, end - t)
            status, h, ratio, last, rejections = accepted_step(
                factor, solve, stage, at, at_k, at_j, k, y, x, g, f0, ft, yn, values, segment, w, u,
                t, start, end, h, moving, relative, absolute,
            )  # fmt: skip
            count[3] += rejections
            if status != DONE:
                break
            reached = end if last else t + h
            row = complete_step(times, row, reached, t, h, y, yn, k, x, g, rows)
            t = reached
            taken += 1
            h *= min(ratio, 1.0) if rejections else ratio
        if status != DONE:
            break
        segment += 1
        start = t
        h = 0.0
    clock[0], clock[1], clock[2] = t, h, start
    count[0], count[1], count[2] = segment, row, count[2] + taken
    return status
