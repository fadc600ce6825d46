"""Kernel: a run by Rodas4, adaptive, through segments in which the inputs are linear."""

from __future__ import annotations

from typing import Any

import numba

from ....core.diagnostics import Status
from .parts import CONTRACTED_PART
from .rodas4_step import interpolate, prepare_dense_output, take_step
from .segments import write_present

DONE, PAUSED = Status.DONE.value, Status.PAUSED.value


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
def begin_segment(slopes: Any, w: Any, ft: Any) -> Any:
    """Set the slopes `w` of the inputs and the derivative `ft` with respect to time; whether an input changes."""
    moving = False
    for i in range(w.shape[0]):
        w[i] = slopes[i]
        moving = moving or w[i] != 0.0
    for i in range(ft.shape[0]):
        ft[i] = 0.0
    return moving


@CONTRACTED_PART
def complete_step(
    times: Any, row: Any, reached: Any, t: Any, h: Any, y: Any, yn: Any, k1: Any, k2: Any, k3: Any, k4: Any, k5: Any,
    x: Any, g: Any, rows: Any,
) -> Any:  # fmt: skip
    """Write the states at the output times up to `reached` by the dense output, then copy `yn` to `y`; the next row."""
    if row < times.shape[0] and times[row] <= reached:
        prepare_dense_output(k1, k2, k3, k4, k5, x, g)  # x and g are free by now
    while row < times.shape[0] and times[row] <= reached:
        interpolate(y, yn, x, g, (times[row] - t) / h, rows[row])
        row += 1
    for i in range(y.shape[0]):
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
    f0, ft, x, yn, g, k, u, w, jacobian, factors = workspace(work, y.shape[0], values.shape[1], jacobian_size)
    k1, k2, k3, k4, k5, k6 = k
    t, h, start = clock[0], clock[1], clock[2]
    segment, taken, status = count[0], 0, DONE
    row = write_present(times, count[1], t, y, rows)
    while segment < ends.shape[0]:
        end, base = ends[segment], values[segment]
        moving = begin_segment(slopes[segment], w, ft)
        while t < end:
            if taken >= budget:
                status = PAUSED
                break
            status, h, following, last, rejections = take_step(
                stage, jac, factor, solve, df_dt, c, y, base, w, moving, t, start, end, h, relative, absolute,
                f0, ft, u, x, g, k1, k2, k3, k4, k5, k6, yn, jacobian, factors,
            )  # fmt: skip
            count[3] += rejections
            if status != DONE:
                break
            reached = end if last else t + h
            row = complete_step(times, row, reached, t, h, y, yn, k1, k2, k3, k4, k5, x, g, rows)
            t = reached
            taken += 1
            h = following
        if status != DONE:
            break
        segment += 1
        start = t
        h = 0.0
    clock[0], clock[1], clock[2] = t, h, start
    count[0], count[1], count[2] = segment, row, count[2] + taken
    return status
