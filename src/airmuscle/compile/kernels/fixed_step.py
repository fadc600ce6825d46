"""Fixed steps of a one-step method; the last step of a segment is shortened so that its end is met exactly.

A row between two steps is reached by a separate step from which the run does not continue, so that the solution does
not depend on the output times.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from ...core.status import Status
from .calls import invoke, pointer
from .parts import CONTRACTED_PART
from .segments import set_inputs, set_slopes, write_present

DONE, PAUSED, NOT_FINITE = Status.DONE.value, Status.PAUSED.value, Status.NOT_FINITE.value


@CONTRACTED_PART
def write_between(
    step: Any, at_y: Any, at_u: Any, at_c: Any, at_w: Any, at_new: Any, new: Any,
    times: Any, row: Any, limit: Any, t: Any, rows: Any,
) -> Any:  # fmt: skip
    """Write the states at the output times before `limit`, each reached by a step of its own; the next row."""
    while row < times.shape[0] and times[row] < limit:
        invoke(step, (at_y, at_u, at_c, at_w, times[row] - t, at_new))
        for i in range(new.shape[0]):
            rows[row, i] = new[i]
        row += 1
    return row


@CONTRACTED_PART
def take(new: Any, y: Any) -> Any:
    """Copy the new states to `y`; the sum of their sizes."""
    total_size = 0.0
    for i in range(y.shape[0]):
        y[i] = new[i]
        total_size += abs(new[i])
    return total_size


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def fixed_step(
    step: Any, c: Any, y: Any, ends: Any, values: Any, slopes: Any, times: Any, rows: Any,
    length: Any, clock: Any, count: Any, budget: Any, work: Any,
) -> Any:  # fmt: skip
    """Advance `y` (n,) through the segments by steps of `length`, and write the states at `times` into `rows`.

    step(x, u, c, w, h, y)  address of the printed step; `c` what it needs of the parameters
    ends, values, slopes, clock, count, budget  as in `rodas4`; clock[1] counts the steps of the current segment
    work  (n + 2 m,): the caller owns it, because an array that a kernel makes and then knows by address alone is
          freed before its last use
    """
    n = y.shape[0]
    m = values.shape[1]
    new, u, w = work[:n], work[n : n + m], work[n + m : n + 2 * m]
    at_y, at_u, at_c, at_w, at_new = pointer(y), pointer(u), pointer(c), pointer(w), pointer(new)
    t, start = clock[0], clock[2]
    segment, row = count[0], count[1]
    taken = 0
    status = DONE
    row = write_present(times, row, t, y, rows)
    while segment < ends.shape[0]:
        end = ends[segment]
        set_slopes(slopes, segment, w)
        total = int(np.ceil((end - start) / length - 1e-6))
        done = int(clock[1])
        while done < total:
            if taken >= budget:
                status = PAUSED
                break
            set_inputs(values, segment, t - start, w, u)
            reached = end if done + 1 == total else start + (done + 1) * length
            row = write_between(step, at_y, at_u, at_c, at_w, at_new, new, times, row, reached - 1e-9 * length, t, rows)
            h = length if done + 1 < total else end - t
            invoke(step, (at_y, at_u, at_c, at_w, h, at_new))
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
    clock[0], clock[2] = t, start
    count[0], count[1] = segment, row
    count[2] += taken
    return status
