"""Fixed steps of a printed one-step method for many systems at once, one a lane, each on its own
clock.

Every lane takes exactly the steps that `fixed_step` would take for it alone: its own segments, the
last step of each shortened so that its end is met, and rows between two steps reached by a step of
their own. Where lanes differ, each has its own length of step, and one that waits has the length
zero; where all may go on with full steps, they do so without a look at the clock. So the result of
a lane does not depend on its neighbours.
"""

import numba
import numpy as np

from ....core import Status
from .calls import PART, invoke, pointer

DONE = Status.DONE.value
NOT_FINITE = Status.NOT_FINITE.value
INTERRUPTED = Status.INTERRUPTED.value
MAX_UNINTERRUPTED = 10_000
"""Steps between two checks whether the caller wants to stop."""


@PART
def begin_segments(
    segment, first, last, ended, total, start, begin, length, ends, values, slopes, base, w, u
):
    """Set steps and inputs of the present segment of each lane; whether an input changes within
    one.
    """
    moving = False
    for lane in range(segment.shape[0]):
        s = segment[lane]
        ended[lane] = 1 if s >= last[lane] else 0
        s = min(s, last[lane] - 1)
        total[lane] = np.ceil((ends[s] - start[lane]) / length - 1e-6)
        for i in range(base.shape[0]):
            base[i, lane] = values[s, i]
            w[i, lane] = slopes[s, i]
            if ended[lane] != 0:
                base[i, lane] += (ends[s] - (begin if s == first[lane] else ends[s - 1])) * slopes[
                    s, i
                ]
                w[i, lane] = 0.0
            moving = moving or w[i, lane] != 0.0
            u[i, lane] = base[i, lane]
    return moving


@PART
def set_inputs(base, w, done, further, length, u):
    """The inputs of each lane after its steps and so many further ones."""
    for i in range(base.shape[0]):
        for lane in range(done.shape[0]):
            u[i, lane] = base[i, lane] + ((done[lane] + further) * length) * w[i, lane]


@PART
def count_common_steps(ended, total, done, start, instant, length):
    """The number of full steps that every lane may take at once before the next row."""
    common = float(MAX_UNINTERRUPTED)
    for lane in range(ended.shape[0]):
        full = -1.0 if ended[lane] != 0 else total[lane] - 1.0 - done[lane]
        before = np.floor((instant - start[lane]) / length + 1e-9) - done[lane]
        common = min(common, full, before)
    return common


@PART
def take_common_steps(step, at, common, moving, base, w, u, h, length, done, y, other):
    """Advance all lanes by so many full steps; at  (y, u, c, w, h, other): addresses."""
    at_y, at_u, at_c, at_w, at_h, at_other = at
    n, width = y.shape
    for lane in range(width):
        h[0, lane] = length
    for j in range(int(common)):
        if moving:
            set_inputs(base, w, done, j, length, u)
        invoke(step, (at_y, at_u, at_c, at_w, at_h, at_other))
        at_y, at_other = at_other, at_y
    if int(common) % 2:
        for i in range(n):
            for lane in range(width):
                y[i, lane] = other[i, lane]
    for lane in range(width):
        done[lane] += common


@PART
def choose_single_steps(ended, segment, ends, done, total, start, instant, length, h):
    """Set the next step of each lane, zero for one that waits; whether a lane steps."""
    any_steps = False
    for lane in range(ended.shape[0]):
        h[0, lane] = 0.0
        if ended[lane] == 0:
            end = ends[segment[lane]]
            closing = done[lane] + 1.0 >= total[lane]
            reached = end if closing else start[lane] + (done[lane] + 1.0) * length
            if reached <= instant + 1e-9 * length:
                now = start[lane] + done[lane] * length if done[lane] > 0.0 else start[lane]
                h[0, lane] = end - now if closing else length
                any_steps = True
    return any_steps


@PART
def finish_single_steps(h, other, y, done, total, start, ends, segment):
    """Take over the states of the lanes that stepped; whether a lane begins another segment."""
    entered = False
    for lane in range(y.shape[1]):
        if h[0, lane] != 0.0:
            for i in range(y.shape[0]):
                y[i, lane] = other[i, lane]
            done[lane] += 1.0
            if done[lane] >= total[lane]:
                start[lane] = ends[segment[lane]]
                segment[lane] += 1
                done[lane] = 0.0
                entered = True
    return entered


@PART
def advance_lanes(
    step,
    at,
    instant,
    moving,
    entered,
    stop,
    segment,
    first,
    last,
    ended,
    total,
    done,
    start,
    begin,
    length,
    ends,
    values,
    slopes,
    base,
    w,
    u,
    h,
    y,
    other,
):
    """Take the steps of all lanes that end before an instant.

    Returns DONE or INTERRUPTED, whether an input changes within a segment, and whether a lane
    begins another segment.
    """
    status = DONE
    while True:
        if stop[0] != 0:
            status = INTERRUPTED
            break
        if entered:
            moving = begin_segments(
                segment,
                first,
                last,
                ended,
                total,
                start,
                begin,
                length,
                ends,
                values,
                slopes,
                base,
                w,
                u,
            )
            entered = False
        common = count_common_steps(ended, total, done, start, instant, length)
        if common > 0.0:
            take_common_steps(step, at, common, moving, base, w, u, h, length, done, y, other)
            continue
        if not choose_single_steps(ended, segment, ends, done, total, start, instant, length, h):
            break
        if moving:
            set_inputs(base, w, done, 0, length, u)
        invoke(step, at)
        entered = finish_single_steps(h, other, y, done, total, start, ends, segment)
    return status, moving, entered


@PART
def choose_steps_to_row(ended, start, done, instant, length, h):
    """Set the step of each lane to the instant of a row; whether a lane needs one."""
    between = False
    for lane in range(ended.shape[0]):
        h[0, lane] = 0.0
        ahead = instant - (start[lane] + done[lane] * length)
        if ended[lane] == 0 and ahead > 1e-9 * length:
            h[0, lane] = ahead
            between = True
    return between


@PART
def keep_others(h, y, other):
    """Copy the states of the lanes that did not step."""
    for lane in range(y.shape[1]):
        if h[0, lane] == 0.0:
            for i in range(y.shape[0]):
                other[i, lane] = y[i, lane]


@PART
def set_inputs_at(instant, base, w, start, u):
    """The inputs of each lane at an instant."""
    for i in range(base.shape[0]):
        for lane in range(start.shape[0]):
            u[i, lane] = base[i, lane] + (instant - start[lane]) * w[i, lane]


@PART
def write_columns(chosen, row, states, o, u, rows):
    """Write the chosen states, outputs and inputs of all lanes to a row."""
    n = states.shape[0]
    k = o.shape[0]
    for j in range(chosen.shape[0]):
        i = chosen[j]
        for lane in range(states.shape[1]):
            if i < n:
                rows[j, lane, row] = states[i, lane]
            elif i < n + k:
                rows[j, lane, row] = o[i - n, lane]
            else:
                rows[j, lane, row] = u[i - n - k, lane]


@numba.njit(error_model="numpy", nogil=True)
def lanes(
    prepare,
    step,
    outputs,
    p,
    c,
    y,
    other,
    u,
    base,
    w,
    h,
    o,
    ends,
    values,
    slopes,
    first,
    last,
    begin,
    length,
    times,
    chosen,
    rows,
    final,
    status,
    stop,
    segment,
    ended,
    done,
    total,
    start,
):
    """Integrate the states `y` (n, W) of W systems from `begin` through their segments; DONE or
    INTERRUPTED.

    prepare(p, c), step(x, u, c, w, h, y), outputs(x, u, c, o)  addresses of the printed functions,
        W lanes each
    p, c, y, other, u, base, w, h, o  (k, W) arrays of the printed numbers, each beginning at a
                                      multiple of 64 bytes; p and y are given, the rest is room
    ends, values, slopes  (S,), (S, m), (S, m): segments of all systems, one after the other
    first, last           (W,): the segments of each lane are first .. last - 1
    times, chosen         (T,) instants in rising order, (C,) columns: states, then outputs, then
                          inputs
    rows, final, status   (C, W, T), (W, n), (W,): what is found
    stop                  (1,): the caller sets it to something else than 0 to end this early
    segment .. start      (W,): workspace
    """
    n, width = y.shape
    moving = False
    entered = True
    needs_outputs = False
    for lane in range(width):
        segment[lane] = first[lane]
        ended[lane] = 0
        done[lane] = 0.0
        start[lane] = begin
    invoke(prepare, (pointer(p), pointer(c)))
    at = (pointer(y), pointer(u), pointer(c), pointer(w), pointer(h), pointer(other))
    for j in range(chosen.shape[0]):
        needs_outputs = needs_outputs or (n <= chosen[j] < n + o.shape[0])
    for row in range(times.shape[0] + 1):
        end_of_all = row == times.shape[0]
        instant = np.inf if end_of_all else times[row]
        status_of_all, moving, entered = advance_lanes(
            step,
            at,
            instant,
            moving,
            entered,
            stop,
            segment,
            first,
            last,
            ended,
            total,
            done,
            start,
            begin,
            length,
            ends,
            values,
            slopes,
            base,
            w,
            u,
            h,
            y,
            other,
        )
        if status_of_all != DONE:
            return status_of_all
        if end_of_all:
            break
        between = choose_steps_to_row(ended, start, done, instant, length, h)
        if moving:
            set_inputs(base, w, done, 0, length, u)
        if between:
            invoke(step, at)
            keep_others(h, y, other)
        if moving:
            set_inputs_at(instant, base, w, start, u)
        if needs_outputs:
            invoke(outputs, (at[5] if between else at[0], at[1], at[2], pointer(o)))
        if between:
            write_columns(chosen, row, other, o, u, rows)
        else:
            write_columns(chosen, row, y, o, u, rows)
    for lane in range(width):
        size = 0.0
        for i in range(n):
            final[lane, i] = y[i, lane]
            size += abs(y[i, lane])
        status[lane] = DONE if size < 1e300 else NOT_FINITE
    return DONE


@numba.njit(error_model="numpy", nogil=True)
def lane_blocks(step, outputs, x, u, c, w, h, other, o, span, steps):
    """Advance the blocks span[0] .. span[1] - 1 by steps[0] steps, then compute their outputs.

    step(x, u, c, w, h, y), outputs(x, u, c, o)  addresses of the printed functions, W lanes each
    x, u, c, o  (B, n, W), (B, m, W), (B, C, W), (B, k, W): states, inputs, what `prepare` left,
                outputs of each block
    w, h, other  (m, W), (1, W), (n, W): zeros, the length of a step, and workspace
    """
    at_w = pointer(w)
    at_h = pointer(h)
    at_other = pointer(other)
    for block in range(span[0], span[1]):
        at_x = pointer(x[block])
        at_u = pointer(u[block])
        at_c = pointer(c[block])
        at = at_x
        beside = at_other
        for _ in range(steps[0]):
            invoke(step, (at, at_u, at_c, at_w, at_h, beside))
            at, beside = beside, at
        if at != at_x:
            for i in range(x.shape[1]):
                for lane in range(x.shape[2]):
                    x[block, i, lane] = other[i, lane]
        invoke(outputs, (at_x, at_u, at_c, pointer(o[block])))
