"""Kernel: sampled loops of many systems at once, one a lane, with common sampling instants and held
commands.

All lanes take the same steps, each exactly the one that `fixed_step` would take for its system
alone: from one sampling instant to the next, the last step of each segment shortened so that its
end is met, and rows between two steps reached by a step of their own.
"""

import numba
import numpy as np

from ....core import Status
from .calls import PART, invoke, pointer
from .lanes import write_columns

DONE = Status.DONE.value
NOT_FINITE = Status.NOT_FINITE.value
INTERRUPTED = Status.INTERRUPTED.value
LARGEST = 1.7976931348623157e308


@PART
def copy_table(source, target):
    """Copy a table of its size; an assignment of slices would need numba at run time."""
    for i in range(target.shape[0]):
        for lane in range(target.shape[1]):
            target[i, lane] = source[i, lane]


@PART
def command_lanes(command, low, high, commanded_at, k, first, values, commands, status):
    """Limit the commands of all lanes, and write them into the segments of interval `k`; NaN fails
    its lane.
    """
    for i in range(command.shape[0]):
        at = commanded_at[i]
        for lane in range(command.shape[1]):
            x = 0.0 + command[i, lane]
            x = low[i, lane] if low[i, lane] > x else x
            x = high[i, lane] if high[i, lane] < x else x
            if not abs(x) <= LARGEST:
                status[lane] = NOT_FINITE
            commands[k, i, lane] = x
            for s in range(first[k], first[k + 1]):
                values[s, at, lane] = x


@PART
def set_lane_inputs(values, slopes, s, ahead, u):
    """The inputs of all lanes so long after the start of segment `s`."""
    for i in range(u.shape[0]):
        for lane in range(u.shape[1]):
            u[i, lane] = values[s, i, lane] + ahead * slopes[s, i, lane]


@PART
def check_lanes(y, bounds, status):
    """Fail the lanes whose states are no numbers, or below their bounds."""
    for lane in range(y.shape[1]):
        size = 0.0
        below = False
        for i in range(y.shape[0]):
            size += abs(y[i, lane])
            below = below or y[i, lane] < bounds[i]
        if below or not size < 1e300:
            status[lane] = NOT_FINITE


@PART
def write_row(
    outputs, chosen, row, s, ahead, values, slopes, c, states, base, o, rows, bounds, status
):
    """Write the chosen states, outputs and inputs of all lanes at a row, so long after the start of
    its segment.
    """
    n = states.shape[0]
    k = o.shape[0]
    check_lanes(states, bounds, status)
    set_lane_inputs(values, slopes, s, ahead, base)
    needs_outputs = False
    for j in range(chosen.shape[0]):
        needs_outputs = needs_outputs or n <= chosen[j] < n + k
    if needs_outputs:
        invoke(outputs, (pointer(states), pointer(base), pointer(c), pointer(o)))
    write_columns(chosen, row, states, o, base, rows)


@PART
def advance_segment(
    step,
    outputs,
    s,
    start,
    end,
    length,
    values,
    slopes,
    c,
    y,
    other,
    u,
    base,
    w,
    h,
    o,
    times,
    row,
    row_segment,
    starts,
    chosen,
    rows,
    bounds,
    status,
):
    """Take the steps of segment `s`, and write the rows before its end; the next row."""
    for i in range(w.shape[0]):
        for lane in range(w.shape[1]):
            w[i, lane] = slopes[s, i, lane]
    total = int(np.ceil((end - start) / length - 1e-6))
    t = start
    for done in range(total):
        closing = done + 1 == total
        reached = end if closing else start + (done + 1) * length
        while row < times.shape[0] and times[row] < reached - 1e-9 * length:
            at = row_segment[row]
            ahead = times[row] - starts[at]
            if times[row] > t + 1e-9 * length:
                set_lane_inputs(values, slopes, s, t - start, u)
                h[0, :] = times[row] - t
                invoke(
                    step,
                    (pointer(y), pointer(u), pointer(c), pointer(w), pointer(h), pointer(other)),
                )
                write_row(
                    outputs,
                    chosen,
                    row,
                    at,
                    ahead,
                    values,
                    slopes,
                    c,
                    other,
                    base,
                    o,
                    rows,
                    bounds,
                    status,
                )
            else:
                write_row(
                    outputs,
                    chosen,
                    row,
                    at,
                    ahead,
                    values,
                    slopes,
                    c,
                    y,
                    base,
                    o,
                    rows,
                    bounds,
                    status,
                )
            row += 1
        set_lane_inputs(values, slopes, s, t - start, u)
        h[0, :] = end - t if closing else length
        invoke(step, (pointer(y), pointer(u), pointer(c), pointer(w), pointer(h), pointer(other)))
        copy_table(other, y)
        t = reached
    set_lane_inputs(values, slopes, s, end - start, u)
    return row


@numba.njit(error_model="numpy", nogil=True)
def loop_lanes(
    prepare,
    step,
    outputs,
    sample,
    p,
    c,
    y,
    other,
    u,
    base,
    w,
    h,
    o,
    parameters,
    memory,
    later,
    measured,
    setpoint,
    command,
    low,
    high,
    period,
    edges,
    setpoints,
    first,
    starts,
    ends,
    values,
    slopes,
    length,
    measured_at,
    commanded_at,
    bounds,
    times,
    row_segment,
    chosen,
    rows,
    samples,
    commands,
    status,
    stop,
):
    """Run the loops of W systems from sample to sample; DONE or INTERRUPTED.

    prepare, step, outputs  as in `lanes`; sample(measured, setpoints, memory, low, high, period,
                            parameters, command,
                            later)  address of the controller in W lanes
    p .. period             (k, W) arrays of the printed numbers, each beginning at a multiple of 64
                            bytes; p, y, u (the inputs before the first sample), memory, parameters,
                            low, high and period are given
    edges (K + 1,), setpoints (K, s, W), first (K + 1,)  intervals, and the first segment of each
    starts, ends (S,), values, slopes (S, m, W)  segments of the inputs; the commands are written
                                                 into them
    times, row_segment      (T,) instants in rising order, and the segment from which the inputs of
                            each are shown
    chosen, rows            (C,) columns: states, then outputs, then inputs; (C, W, T)
    samples, commands       (K, .., W) measurements and commands of every interval
    bounds, status, stop    (n,); (W,) DONE, or NOT_FINITE for a lane whose run failed somehow; as
                            in `lanes`
    """
    n, width = y.shape
    needs_outputs = False
    for i in range(measured_at.shape[0]):
        needs_outputs = needs_outputs or measured_at[i] >= n
    status[:] = DONE
    invoke(prepare, (pointer(p), pointer(c)))
    row = 0
    for k in range(edges.shape[0] - 1):
        if stop[0] != 0:
            return INTERRUPTED
        if needs_outputs:
            invoke(outputs, (pointer(y), pointer(u), pointer(c), pointer(o)))
        for i in range(measured_at.shape[0]):
            at = measured_at[i]
            for lane in range(width):
                x = y[at, lane] if at < n else o[at - n, lane]
                if not abs(x) <= LARGEST:
                    status[lane] = NOT_FINITE
                measured[i, lane] = samples[k, i, lane] = x
        copy_table(setpoints[k], setpoint)
        invoke(
            sample,
            (
                pointer(measured),
                pointer(setpoint),
                pointer(memory),
                pointer(low),
                pointer(high),
                pointer(period),
                pointer(parameters),
                pointer(command),
                pointer(later),
            ),
        )
        copy_table(later, memory)
        command_lanes(command, low, high, commanded_at, k, first, values, commands, status)
        for s in range(first[k], first[k + 1]):
            row = advance_segment(
                step,
                outputs,
                s,
                starts[s],
                ends[s],
                length,
                values,
                slopes,
                c,
                y,
                other,
                u,
                base,
                w,
                h,
                o,
                times,
                row,
                row_segment,
                starts,
                chosen,
                rows,
                bounds,
                status,
            )
        check_lanes(y, bounds, status)
    while row < times.shape[0]:
        at = row_segment[row]
        write_row(
            outputs,
            chosen,
            row,
            at,
            times[row] - starts[at],
            values,
            slopes,
            c,
            y,
            base,
            o,
            rows,
            bounds,
            status,
        )
        row += 1
    return DONE
