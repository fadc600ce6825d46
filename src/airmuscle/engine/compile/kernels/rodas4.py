"""Rodas4, a Rosenbrock method of order four for stiff systems: its step, and the kernel of an
adaptive run.

Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section VI.4, method RODAS.
Stiffly accurate, L-stable, six stages with one factorisation, dense output of order three. It
carries the slope of inputs that are linear within a segment, and meets its end exactly. Exported
programs print `single_step` and `state_between`.
"""

from math import sqrt

import numba

from ....core import Status
from .calls import CONTRACTED_PART, invoke, pointer
from .evaluate import set_inputs, write_present

DONE = Status.DONE.value
PAUSED = Status.PAUSED.value
STEP_TOO_SMALL = Status.STEP_TOO_SMALL.value
NOT_FINITE = Status.NOT_FINITE.value

GAMMA = 0.25
A21 = 1.544
C21 = -5.6688
A31 = 0.9466785280815826
A32 = 0.2557011698983284
A41 = 3.314825187068521
A42 = 2.896124015972201
A43 = 0.9986419139977817
A51 = 1.221224509226641
A52 = 6.019134481288629
A53 = 12.53708332932087
A54 = -0.6878860361058950
C31 = -2.430093356833875
C32 = -0.2063599157091915
C41 = -0.1073529058151375
C42 = -9.594562251023355
C43 = -20.47028614809616
C51 = 7.496443313967647
C52 = -10.24680431464352
C53 = -33.99990352819905
C54 = 11.70890893206160

C61 = 8.083246795921522
C62 = -7.981132988064893
C63 = -31.52159432874371
C64 = 16.31930543123136
C65 = -6.058818238834054
D1 = 0.25
D2 = -0.1043
D3 = 0.1035
D4 = -0.03620000000000023
N2 = 0.386
N3 = 0.21
N4 = 0.63

H21 = 10.12623508344586
H22 = -7.487995877610167
H23 = -34.80091861555747
H24 = -7.992771707568823
H25 = 1.025137723295662

H31 = -0.6762803392801253
H32 = 6.087714651680015
H33 = 16.43084320892478
H34 = 24.76722511418386
H35 = -6.594389125716872


@CONTRACTED_PART
def initial_step(y, f0, relative, absolute, left):
    """The first step of a segment, from the sizes of states and rates; at most `left`."""
    size = 0.0
    rate = 0.0
    for i in range(y.shape[0]):
        scale = absolute[i] + relative * abs(y[i])
        size += (y[i] / scale) * (y[i] / scale)
        rate += (f0[i] / scale) * (f0[i] / scale)
    h = left
    if rate > 0.0:
        h = min(h, 0.1 * sqrt(sqrt(relative)) * sqrt((size + 1.0) / rate))
    return h


@CONTRACTED_PART
def compute_stages(
    solve, stage, c, factors, y, base, w, moving, t, start, h, f0, ft, u, x, g, k1, k2, k3, k4
):
    """Stages one to four of a step from `t`; afterwards the inputs `u` are those at its end."""
    n = y.shape[0]
    r = 1.0 / h
    for i in range(n):
        g[i] = f0[i] + h * D1 * ft[i]
    invoke(solve, (pointer(factors), pointer(g), pointer(k1)))
    if moving:
        set_inputs(base, t + N2 * h - start, w, u)
    for i in range(n):
        x[i] = y[i] + A21 * k1[i]
        g[i] = r * (C21 * k1[i]) + h * D2 * ft[i]
    invoke(stage, (pointer(x), pointer(u), pointer(c), pointer(factors), pointer(g), pointer(k2)))
    if moving:
        set_inputs(base, t + N3 * h - start, w, u)
    for i in range(n):
        x[i] = y[i] + A31 * k1[i] + A32 * k2[i]
        g[i] = r * (C31 * k1[i] + C32 * k2[i]) + h * D3 * ft[i]
    invoke(stage, (pointer(x), pointer(u), pointer(c), pointer(factors), pointer(g), pointer(k3)))
    if moving:
        set_inputs(base, t + N4 * h - start, w, u)
    for i in range(n):
        x[i] = y[i] + A41 * k1[i] + A42 * k2[i] + A43 * k3[i]
        g[i] = r * (C41 * k1[i] + C42 * k2[i] + C43 * k3[i]) + h * D4 * ft[i]
    invoke(stage, (pointer(x), pointer(u), pointer(c), pointer(factors), pointer(g), pointer(k4)))
    if moving:
        set_inputs(base, t + h - start, w, u)


@CONTRACTED_PART
def compute_last_stages(stage, c, factors, y, u, h, x, g, k1, k2, k3, k4, k5, k6):
    """Stages five and six, at the end of the step."""
    n = y.shape[0]
    r = 1.0 / h
    for i in range(n):
        x[i] = y[i] + A51 * k1[i] + A52 * k2[i] + A53 * k3[i] + A54 * k4[i]
        g[i] = r * (C51 * k1[i] + C52 * k2[i] + C53 * k3[i] + C54 * k4[i])
    invoke(stage, (pointer(x), pointer(u), pointer(c), pointer(factors), pointer(g), pointer(k5)))
    for i in range(n):
        x[i] += k5[i]
        g[i] = r * (C61 * k1[i] + C62 * k2[i] + C63 * k3[i] + C64 * k4[i] + C65 * k5[i])
    invoke(stage, (pointer(x), pointer(u), pointer(c), pointer(factors), pointer(g), pointer(k6)))


@CONTRACTED_PART
def finish_step(y, x, k6, relative, absolute, yn):
    """The states `yn` at the end of the step; its error in tolerances, rms over the states."""
    error = 0.0
    for i in range(y.shape[0]):
        yn[i] = x[i] + k6[i]
        part = k6[i] / (absolute[i] + relative * max(abs(y[i]), abs(yn[i])))
        error += part * part
    return sqrt(error / y.shape[0]) + 1e-16


@CONTRACTED_PART
def step_factor(error):
    """The ratio of the next step to this one."""
    ratio = 0.5
    if error < 1e300:
        ratio = min(6.0, max(0.2, 0.9 / sqrt(sqrt(error))))
    return ratio


@CONTRACTED_PART
def take_step(
    stage,
    jac,
    factor,
    solve,
    df_dt,
    c,
    y,
    base,
    w,
    moving,
    t,
    start,
    end,
    h,
    relative,
    absolute,
    f0,
    ft,
    u,
    x,
    g,
    k1,
    k2,
    k3,
    k4,
    k5,
    k6,
    yn,
    jacobian,
    factors,
):
    """Try steps from `t`, beginning with `h` (0: to be found), until one is accepted; it leads from
    `y` to `yn`.

    Returns a status, the step, the next step, whether it meets `end`, and the number of rejected
    steps.
    """
    set_inputs(base, t - start, w, u)
    invoke(jac, (pointer(y), pointer(u), pointer(c), pointer(f0), pointer(jacobian)))
    if moving:
        invoke(df_dt, (pointer(y), pointer(u), pointer(c), pointer(w), pointer(ft)))
    if h <= 0.0:
        h = initial_step(y, f0, relative, absolute, end - t)
    status = DONE
    rejections = 0
    while True:
        last = t + 1.000001 * h >= end
        tried = h
        if last:
            h = end - t
        invoke(factor, (pointer(jacobian), (1.0 / h) / GAMMA, pointer(factors)))
        compute_stages(
            solve,
            stage,
            c,
            factors,
            y,
            base,
            w,
            moving,
            t,
            start,
            h,
            f0,
            ft,
            u,
            x,
            g,
            k1,
            k2,
            k3,
            k4,
        )
        compute_last_stages(stage, c, factors, y, u, h, x, g, k1, k2, k3, k4, k5, k6)
        error = finish_step(y, x, k6, relative, absolute, yn)
        ratio = step_factor(error)
        if error <= 1.0:
            break
        rejections += 1
        h *= ratio
        if h <= 1e-14 * max(abs(t), end - start):
            status = STEP_TOO_SMALL if error < 1e300 else NOT_FINITE
            break
    if rejections > 0:
        ratio = min(ratio, 1.0)
    following = h * ratio
    if last:
        following = max(
            following, tried
        )  # a step cut short by the end of a segment does not shorten the next
    return status, h, following, last, rejections


@CONTRACTED_PART
def prepare_dense_output(k1, k2, k3, k4, k5, d2, d3):
    """The coefficients of the dense output of a step."""
    for i in range(d2.shape[0]):
        d2[i] = H21 * k1[i] + H22 * k2[i] + H23 * k3[i] + H24 * k4[i] + H25 * k5[i]
        d3[i] = H31 * k1[i] + H32 * k2[i] + H33 * k3[i] + H34 * k4[i] + H35 * k5[i]


@CONTRACTED_PART
def interpolate(y, yn, d2, d3, q, between):
    """The states `between` those before and after a step, `q` of the step after its beginning."""
    p = 1.0 - q
    for i in range(y.shape[0]):
        between[i] = y[i] * p + q * (yn[i] + p * (d2[i] + q * d3[i]))


@CONTRACTED_PART
def single_step(
    stage,
    jac,
    factor,
    solve,
    df_dt,
    c,
    y,
    base,
    w,
    moving,
    t,
    start,
    end,
    h,
    relative,
    nominal,
    absolute,
    f0,
    ft,
    u,
    x,
    g,
    k1,
    k2,
    k3,
    k4,
    k5,
    k6,
    yn,
    jacobian,
    factors,
    d2,
    d3,
):
    """A step from `y` at `t` to `yn`, with its dense output; the absolute tolerance follows from
    the nominal states.

    Returns a status, the time reached, the step, the next step, and the number of rejected steps.
    """
    for i in range(y.shape[0]):
        absolute[i] = relative * nominal[i]
        ft[i] = 0.0
    status, h, following, last, rejections = take_step(
        stage,
        jac,
        factor,
        solve,
        df_dt,
        c,
        y,
        base,
        w,
        moving,
        t,
        start,
        end,
        h,
        relative,
        absolute,
        f0,
        ft,
        u,
        x,
        g,
        k1,
        k2,
        k3,
        k4,
        k5,
        k6,
        yn,
        jacobian,
        factors,
    )
    prepare_dense_output(k1, k2, k3, k4, k5, d2, d3)
    reached = end if last else t + h
    return status, reached, h, following, rejections


@CONTRACTED_PART
def state_between(y, yn, d2, d3, t, h, time, between):
    """The states at a time within the step from `y` at `t` to `yn`."""
    interpolate(y, yn, d2, d3, (time - t) / h, between)


@CONTRACTED_PART
def workspace(work, n, m, jacobian_size):
    """The arrays f0, ft, x, yn, g, k1 .. k6 (n,), u, w (m,), Jacobian and factors within the
    workspace.
    """
    rest = 11 * n + 2 * m
    return (
        work[:n],
        work[n : 2 * n],
        work[2 * n : 3 * n],
        work[3 * n : 4 * n],
        work[4 * n : 5 * n],
        (
            work[5 * n : 6 * n],
            work[6 * n : 7 * n],
            work[7 * n : 8 * n],
            work[8 * n : 9 * n],
            work[9 * n : 10 * n],
            work[10 * n : 11 * n],
        ),
        work[11 * n : 11 * n + m],
        work[11 * n + m : rest],
        work[rest : rest + jacobian_size],
        work[rest + jacobian_size :],
    )


@CONTRACTED_PART
def begin_segment(slopes, w, ft):
    """Set the slopes `w` of the inputs and the derivative `ft` with respect to time; whether an
    input changes.
    """
    moving = False
    for i in range(w.shape[0]):
        w[i] = slopes[i]
        moving = moving or w[i] != 0.0
    for i in range(ft.shape[0]):
        ft[i] = 0.0
    return moving


@CONTRACTED_PART
def complete_step(times, row, reached, t, h, y, yn, k1, k2, k3, k4, k5, x, g, rows):
    """Write the states at the output times up to `reached` by the dense output, then copy `yn` to
    `y`; the next row.
    """
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
    stage,
    jac,
    factor,
    solve,
    df_dt,
    jacobian_size,
    factor_size,
    c,
    y,
    ends,
    values,
    slopes,
    times,
    rows,
    relative,
    absolute,
    clock,
    count,
    budget,
    work,
):
    """Advance `y` (n,) through the segments, and write the states at `times` into `rows`; a status
    code.

    stage .. df_dt  addresses of the printed functions; `c` what they need of the parameters
    ends, values, slopes  (S,), (S, m), (S, m): end of each segment, inputs at its start, their
                          slopes
    clock  (3,): time, next step (0: to be found), start of the current segment
    count  (4,): segment, next row, steps, rejected steps
    budget  steps after which the kernel pauses, so that its caller can be interrupted; call again
            to go on
    work  (11 n + 2 m + jacobian_size + factor_size,): of the caller; a kernel's own would be freed
          before its last use
    """
    f0, ft, x, yn, g, k, u, w, jacobian, factors = workspace(
        work, y.shape[0], values.shape[1], jacobian_size
    )
    k1, k2, k3, k4, k5, k6 = k
    t = clock[0]
    h = clock[1]
    start = clock[2]
    segment = count[0]
    taken = 0
    status = DONE
    row = write_present(times, count[1], t, y, rows)
    while segment < ends.shape[0]:
        end = ends[segment]
        base = values[segment]
        moving = begin_segment(slopes[segment], w, ft)
        while t < end:
            if taken >= budget:
                status = PAUSED
                break
            status, h, following, last, rejections = take_step(
                stage,
                jac,
                factor,
                solve,
                df_dt,
                c,
                y,
                base,
                w,
                moving,
                t,
                start,
                end,
                h,
                relative,
                absolute,
                f0,
                ft,
                u,
                x,
                g,
                k1,
                k2,
                k3,
                k4,
                k5,
                k6,
                yn,
                jacobian,
                factors,
            )
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
    clock[0] = t
    clock[1] = h
    clock[2] = start
    count[0], count[1], count[2] = segment, row, count[2] + taken
    return status
