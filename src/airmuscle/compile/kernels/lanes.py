"""Fixed steps of a printed one-step method for many systems at once, one a lane, each on its own clock.

Every lane takes exactly the steps that `fixed_step` would take for it alone: its own segments, the last step of each
shortened so that its end is met, and rows between two steps reached by a step of their own. Where lanes differ, each
has its own length of step, and one that waits has the length zero; where all may go on with full steps, they do so
without a look at the clock. So the result of a lane does not depend on its neighbours.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from ...core.status import Status
from .calls import invoke, pointer

DONE, NOT_FINITE, INTERRUPTED = Status.DONE.value, Status.NOT_FINITE.value, Status.INTERRUPTED.value
MAX_UNINTERRUPTED = 10_000
"""Steps between two checks whether the caller wants to stop."""


@numba.njit(error_model="numpy", nogil=True)
def lanes(
    prepare: Any, step: Any, outputs: Any, p: Any, c: Any, y: Any, other: Any, u: Any, base: Any, w: Any, h: Any,
    o: Any, ends: Any, values: Any, slopes: Any, first: Any, last: Any, begin: Any, length: Any, times: Any,
    chosen: Any, rows: Any, final: Any, status: Any, stop: Any,
    segment: Any, ended: Any, done: Any, total: Any, start: Any,
) -> Any:  # fmt: skip
    """Carry the states `y` (n, W) of W systems from `begin` through their segments; DONE or INTERRUPTED.

    prepare(p, c), step(x, u, c, w, h, y), outputs(x, u, c, o)  addresses of the printed functions, W lanes each
    p, c, y, other, u, base, w, h, o  (k, W) arrays of the printed numbers, each beginning at a multiple of 64 bytes;
                          p and y are given, the rest is room
    ends, values, slopes  (S,), (S, m), (S, m): segments of all systems, one after the other
    first, last           (W,): the segments of each lane are first .. last - 1
    times, chosen         (T,) instants in rising order, (C,) columns: states, then outputs, then inputs
    rows, final, status   (C, W, T), (W, n), (W,): what is found
    stop                  (1,): the caller sets it to something else than 0 to end this early
    segment .. start      (W,): workspace
    """
    n, width = y.shape
    m = values.shape[1]
    k = o.shape[0]
    moving = False
    for lane in range(width):
        segment[lane], ended[lane], done[lane], start[lane] = first[lane], 0, 0.0, begin
    invoke(prepare, (pointer(p), pointer(c)))
    at_c, at_u, at_w, at_h, at_o = pointer(c), pointer(u), pointer(w), pointer(h), pointer(o)
    at_y, at_other = pointer(y), pointer(other)
    entered = True
    needs_outputs = False
    for j in range(chosen.shape[0]):
        needs_outputs = needs_outputs or (n <= chosen[j] < n + k)
    for row in range(times.shape[0] + 1):
        end_of_all = row == times.shape[0]
        instant = np.inf if end_of_all else times[row]
        while True:
            if stop[0] != 0:
                return INTERRUPTED
            if entered:  # a lane begins a segment
                moving = False
                for lane in range(width):
                    s = segment[lane]
                    ended[lane] = 1 if s >= last[lane] else 0
                    s = min(s, last[lane] - 1)
                    total[lane] = np.ceil((ends[s] - start[lane]) / length - 1e-6)
                    for i in range(m):
                        base[i, lane] = values[s, i]
                        w[i, lane] = slopes[s, i]
                        if ended[lane] != 0:
                            base[i, lane] += (ends[s] - (begin if s == first[lane] else ends[s - 1])) * slopes[s, i]
                            w[i, lane] = 0.0
                        moving = moving or w[i, lane] != 0.0
                        u[i, lane] = base[i, lane]
                entered = False
            common = float(MAX_UNINTERRUPTED)
            for lane in range(width):
                full = -1.0 if ended[lane] != 0 else total[lane] - 1.0 - done[lane]
                before = np.floor((instant - start[lane]) / length + 1e-9) - done[lane]
                common = min(common, full, before)
            if common > 0.0:
                for lane in range(width):
                    h[0, lane] = length
                for j in range(int(common)):
                    if moving:
                        for i in range(m):
                            for lane in range(width):
                                u[i, lane] = base[i, lane] + ((done[lane] + j) * length) * w[i, lane]
                    invoke(step, (at_y, at_u, at_c, at_w, at_h, at_other))
                    at_y, at_other = at_other, at_y
                if int(common) % 2:
                    at_y, at_other = at_other, at_y
                    for i in range(n):
                        for lane in range(width):
                            y[i, lane] = other[i, lane]
                for lane in range(width):
                    done[lane] += common
                continue
            any_steps = False
            for lane in range(width):
                h[0, lane] = 0.0
                if ended[lane] != 0:
                    continue
                end = ends[segment[lane]]
                closing = done[lane] + 1.0 >= total[lane]
                reached = end if closing else start[lane] + (done[lane] + 1.0) * length
                if reached <= instant + 1e-9 * length:
                    now = start[lane] + done[lane] * length if done[lane] > 0.0 else start[lane]
                    h[0, lane] = end - now if closing else length
                    any_steps = True
            if not any_steps:
                break
            if moving:
                for i in range(m):
                    for lane in range(width):
                        u[i, lane] = base[i, lane] + (done[lane] * length) * w[i, lane]
            invoke(step, (at_y, at_u, at_c, at_w, at_h, at_other))
            for lane in range(width):
                if h[0, lane] != 0.0:
                    for i in range(n):
                        y[i, lane] = other[i, lane]
                    done[lane] += 1.0
                    if done[lane] >= total[lane]:
                        start[lane] = ends[segment[lane]]
                        segment[lane] += 1
                        done[lane] = 0.0
                        entered = True
        if end_of_all:
            break
        at_row, between = at_y, False
        for lane in range(width):
            h[0, lane] = 0.0
            ahead = instant - (start[lane] + done[lane] * length)
            if ended[lane] == 0 and ahead > 1e-9 * length:
                h[0, lane] = ahead
                between = True
        if moving:
            for i in range(m):
                for lane in range(width):
                    u[i, lane] = base[i, lane] + (done[lane] * length) * w[i, lane]
        if between:
            invoke(step, (at_y, at_u, at_c, at_w, at_h, at_other))
            at_row = at_other
            for lane in range(width):
                if h[0, lane] == 0.0:
                    for i in range(n):
                        other[i, lane] = y[i, lane]
        if moving:
            for i in range(m):
                for lane in range(width):
                    u[i, lane] = base[i, lane] + (instant - start[lane]) * w[i, lane]
        if needs_outputs:
            invoke(outputs, (at_row, at_u, at_c, at_o))
        for j in range(chosen.shape[0]):
            i = chosen[j]
            for lane in range(width):
                if i < n:
                    rows[j, lane, row] = other[i, lane] if between else y[i, lane]
                elif i < n + k:
                    rows[j, lane, row] = o[i - n, lane]
                else:
                    rows[j, lane, row] = u[i - n - k, lane]
    for lane in range(width):
        size = 0.0
        for i in range(n):
            final[lane, i] = y[i, lane]
            size += abs(y[i, lane])
        status[lane] = DONE if size < 1e300 else NOT_FINITE
    return DONE
