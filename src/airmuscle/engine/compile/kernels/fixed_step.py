"""Fixed steps of a one-step method; the last step of a segment is shortened so that its end is met
exactly.

A row between two steps is reached by a separate step from which the run does not continue, so that
the solution does not depend on the output times. The run calls a step that is printed whole;
`single_step` and `state_between` call the rates stage by stage, because exported programs print
them.
"""

import numba
import numpy as np

from ....core import Status
from .calls import CONTRACTED_PART, invoke, pointer
from .evaluate import set_inputs, write_present

DONE = Status.DONE.value
PAUSED = Status.PAUSED.value
NOT_FINITE = Status.NOT_FINITE.value


@CONTRACTED_PART
def count_steps(start, end, length):
    """The number of steps of a segment, of which the last may be shorter."""
    return np.ceil((end - start) / length - 1e-6)


@CONTRACTED_PART
def plan_step(start, end, t, length, done, total):
    """The end and the length of the step from `t` after `done` of the steps of a segment; the last
    one meets `end`.
    """
    last = done + 1 >= total
    reached = end if last else start + (done + 1) * length
    h = end - t if last else length
    return reached, h


@CONTRACTED_PART
def explicit_step(rhs, c, nodes, table, weights, y, base, w, elapsed, h, u, x, k, yn):
    """A step of an explicit Runge-Kutta method with rates that are called stage by stage, from `y`
    to `yn`.

    nodes (s,), table (s, s), weights (s,)  the tableau of the method
    base, w, elapsed  inputs at the start of the segment, their slopes, and the time since then
    k (s, n)      rates of the stages
    """
    n = y.shape[0]
    for stage in range(weights.shape[0]):
        set_inputs(base, elapsed + nodes[stage] * h, w, u)
        for i in range(n):
            x[i] = y[i]
        for j in range(stage):
            part = h * table[stage, j]
            if part != 0.0:
                for i in range(n):
                    x[i] += part * k[j, i]
        invoke(rhs, (pointer(x), pointer(u), pointer(c), pointer(k[stage])))
    for i in range(n):
        yn[i] = y[i]
    for stage in range(weights.shape[0]):
        part = h * weights[stage]
        if part != 0.0:
            for i in range(n):
                yn[i] += part * k[stage, i]


@CONTRACTED_PART
def take(yn, y):
    """Copy the new states to `y`; the sum of their sizes."""
    total_size = 0.0
    for i in range(y.shape[0]):
        y[i] = yn[i]
        total_size += abs(yn[i])
    return total_size


@CONTRACTED_PART
def single_step(rhs, c, nodes, table, weights, y, base, w, t, start, end, h, done, u, x, k, yn):
    """A step from `y` at `t` to `yn`, after `done` steps of length `h` in this segment.

    Returns a status, the time reached, the step, the next step, and the number of rejected steps.
    """
    reached, taken = plan_step(start, end, t, h, done, count_steps(start, end, h))
    explicit_step(rhs, c, nodes, table, weights, y, base, w, t - start, taken, u, x, k, yn)
    total_size = 0.0
    for i in range(y.shape[0]):
        total_size += abs(yn[i])
    status = DONE if total_size < 1e300 else NOT_FINITE
    return status, reached, taken, h, 0


@CONTRACTED_PART
def state_between(rhs, c, nodes, table, weights, y, base, w, start, t, time, u, x, k, between):
    """The states at a time within the step from `y` at `t`, by a step of its own."""
    explicit_step(rhs, c, nodes, table, weights, y, base, w, t - start, time - t, u, x, k, between)


@CONTRACTED_PART
def write_between(step, y, u, c, w, new, times, row, limit, t, rows):
    """Write the states at the output times before `limit`, each reached by a step of its own; the
    next row.
    """
    while row < times.shape[0] and times[row] < limit:
        invoke(step, (pointer(y), pointer(u), pointer(c), pointer(w), times[row] - t, pointer(new)))
        for i in range(new.shape[0]):
            rows[row, i] = new[i]
        row += 1
    return row


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def fixed_step(step, c, y, ends, values, slopes, times, rows, length, clock, count, budget, work):
    """Advance `y` (n,) through the segments by steps of `length`, and write the states at `times`
    into `rows`.

    step(x, u, c, w, h, y)  address of the printed step; `c` what it needs of the parameters
    ends, values, slopes, clock, count, budget  as in `rodas4`; clock[1] counts the steps of the
                                                current segment
    work  (n + m,): the caller owns it, because an array that a kernel makes and then knows by
          address alone is freed before its last use
    """
    n = y.shape[0]
    new = work[:n]
    u = work[n : n + values.shape[1]]
    t = clock[0]
    start = clock[2]
    segment = count[0]
    row = count[1]
    taken = 0
    status = DONE
    row = write_present(times, row, t, y, rows)
    while segment < ends.shape[0]:
        end = ends[segment]
        base = values[segment]
        w = slopes[segment]
        total = count_steps(start, end, length)
        done = int(clock[1])
        while done < total:
            if taken >= budget:
                status = PAUSED
                break
            set_inputs(base, t - start, w, u)
            reached, h = plan_step(start, end, t, length, done, total)
            row = write_between(step, y, u, c, w, new, times, row, reached - 1e-9 * length, t, rows)
            invoke(step, (pointer(y), pointer(u), pointer(c), pointer(w), h, pointer(new)))
            if not take(new, y) < 1e300:
                status = NOT_FINITE
                break
            t = reached
            done += 1
            taken += 1
            row = write_present(times, row, reached + 1e-9 * length, y, rows)
        if status != DONE:
            clock[1] = done
            break
        segment += 1
        start = t
        clock[1] = 0.0
    clock[0] = t
    clock[2] = start
    count[0] = segment
    count[1] = row
    count[2] += taken
    return status
