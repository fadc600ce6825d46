"""Kernel: a sampled loop, from one sampling instant to the next: measure, command, drive the
inputs, integrate.
"""

import numba

from ....core import Status
from ..kernel_layout import Progress, Waiting
from .calls import PART, call_kernel, invoke, pointer
from .driven_inputs import apply_drivers, is_full, load_columns, merge_inputs

DONE = Status.DONE.value
PAUSED = Status.PAUSED.value
NOT_FINITE = Status.NOT_FINITE.value
NON_FINITE_COMMAND = Status.NON_FINITE_COMMAND.value
BELOW_LIMIT = Status.NEGATIVE_AIR_MASS.value
LARGEST = 1.7976931348623157e308
DRIVER_WIDTH = 4
"""Numbers of the settings and of the state of a driver."""
(
    INTERVAL,
    RUNNING,
    SEGMENTS,
    ROWS,
    SAMPLES,
    STEPS_BEFORE,
    FULL,
    FIRST_SEGMENT,
    FIRST_ROW,
    WAITING,
    RESULT,
) = map(int, Progress)
NOTHING, COMMANDS, DRIVERS, INTEGRATION = map(int, Waiting)


@PART
def measure(outputs, y, applied, c, o, measured_at, measured):
    """Write the measured columns; DONE, or NOT_FINITE."""
    n = y.shape[0]
    needs_outputs = False
    status = DONE
    for i in range(measured_at.shape[0]):
        needs_outputs = needs_outputs or measured_at[i] >= n
    if needs_outputs:
        invoke(outputs, (pointer(y), pointer(applied), pointer(c), pointer(o)))
    for i in range(measured.shape[0]):
        at = measured_at[i]
        x = y[at] if at < n else o[at - n]
        if not abs(x) <= LARGEST:
            status = NOT_FINITE
            break
        measured[i] = x
    return status


@PART
def take_sample(
    outputs,
    y,
    applied,
    c,
    o,
    measured_at,
    sample,
    setpoint,
    low,
    high,
    period,
    parameters,
    controlled,
    memory,
    measured,
    command,
    progress,
):
    """Copy the memory; where the interval is controlled: measure, call the controller, limit its
    commands; a status.

    PAUSED where the controller is called from Python: its commands are limited when the kernel is
    called again.
    """
    status = DONE
    waited = progress[WAITING] == COMMANDS
    if not waited:
        for i in range(memory.shape[1]):
            memory[1, i] = memory[0, i]
        if controlled:
            status = measure(outputs, y, applied, c, o, measured_at, measured)
        if status == DONE and controlled and sample != 0:
            invoke(
                sample,
                (
                    pointer(measured),
                    pointer(setpoint),
                    pointer(memory[0]),
                    pointer(low),
                    pointer(high),
                    pointer(period),
                    pointer(parameters),
                    pointer(command),
                    pointer(memory[1]),
                ),
            )
    progress[WAITING] = NOTHING
    if status == DONE and controlled:
        if sample == 0 and not waited:
            progress[WAITING] = COMMANDS
            return PAUSED
        for i in range(command.shape[0]):
            x = 0.0 + command[i]
            if low[i] > x:
                x = low[i]
            if high[i] < x:
                x = high[i]
            if not abs(x) <= LARGEST:
                status = NON_FINITE_COMMAND
                break
            command[i] = x
    return status


@PART
def apply_sample(k, measured, samples, command, commands, commanded_at, first, values, progress):
    """Write the measurements and the commands of interval `k`, and the commands into its
    segments.
    """
    progress[SAMPLES] = k + 1
    for i in range(measured.shape[0]):
        samples[k, i] = measured[i]
    for i in range(command.shape[0]):
        commands[k, i] = command[i]
        for row in range(first[k], first[k + 1]):
            values[row, commanded_at[i]] = command[i]


@PART
def drive_inputs(
    kinds,
    settings,
    kept_states,
    states,
    columns,
    counts,
    scratch,
    begin,
    ulp,
    ends,
    values,
    slopes,
    first,
    pieces,
    progress,
):
    """Pass an interval's segments through the drivers, if there are any; PAUSED where they are
    called from Python.
    """
    status = DONE
    if kinds.shape[0] > 0:
        load_columns(ends, values, slopes, first, pieces, columns, counts)
        if kinds[0, 0] >= 0:
            apply_drivers(
                kinds, settings, kept_states, states, columns, counts[0], scratch, begin, ulp
            )
        else:
            status = PAUSED
            progress[WAITING] = DRIVERS
    return status


@PART
def start_integrator(
    slots,
    places,
    progress,
    clock,
    count,
    begin,
    at_segment,
    pieces,
    at_row,
    wanted,
    ends,
    values,
    slopes,
    times,
    rows,
):
    """Give the integrator the segments, output times and rows of an interval, and set its clock and
    counts.
    """
    progress[FIRST_SEGMENT] = at_segment
    progress[FIRST_ROW] = at_row
    progress[SEGMENTS] = at_segment + pieces
    progress[ROWS] = at_row
    progress[STEPS_BEFORE] = count[2]
    progress[RUNNING] = 1
    clock[0] = begin
    clock[1] = 0.0
    clock[2] = begin
    count[0] = count[1] = 0
    slots[places[0]], slots[places[1]] = pointer(ends[at_segment:]), pointer(values[at_segment:])
    slots[places[2]], slots[places[3]] = pointer(slopes[at_segment:]), pointer(times[at_row:])
    slots[places[4]] = pointer(rows[at_row:])
    slots[places[0] + 1] = slots[places[1] + 1] = slots[places[2] + 1] = pieces
    slots[places[3] + 1] = slots[places[4] + 1] = wanted


@PART
def call_integrator(integrate, slots, progress):
    """Integrate the interval; its status, or PAUSED where it is integrated from Python, and then
    the status found.
    """
    status = PAUSED
    if integrate != 0:
        status = call_kernel(integrate, pointer(slots))
    elif progress[WAITING] == INTEGRATION:
        progress[WAITING], status = NOTHING, progress[RESULT]
    else:
        progress[WAITING] = INTEGRATION
    return status


@PART
def is_below(y, bounds):
    """Whether a state is below its bound."""
    below = False
    for i in range(y.shape[0]):
        below = below or y[i] < bounds[i]
    return below


@PART
def end_interval(
    progress,
    begin,
    end,
    ends,
    values,
    slopes,
    applied,
    kept_applied,
    y,
    kept,
    memory,
    states,
    kept_states,
):
    """Keep inputs, state, memory and drivers at the end of an interval."""
    progress[INTERVAL] = progress[INTERVAL] + 1
    progress[RUNNING] = 0
    last = progress[SEGMENTS] - 1
    start = ends[last - 1] if last > progress[FIRST_SEGMENT] else begin
    for i in range(applied.shape[0]):
        applied[i] = values[last, i] + slopes[last, i] * (end - start)
        kept_applied[i] = applied[i]
    for i in range(y.shape[0]):
        kept[i] = y[i]
    for i in range(memory.shape[1]):
        memory[0, i] = memory[1, i]
    for d in range(states.shape[0]):
        for i in range(DRIVER_WIDTH):
            kept_states[d, i] = states[d, i]


@numba.njit(error_model="numpy", nogil=True)
def sampled_loop(
    integrate,
    slots,
    places,
    clock,
    count,
    y,
    outputs,
    c,
    o,
    measured_at,
    sample,
    parameters,
    period,
    low,
    high,
    commanded_at,
    edges,
    ulps,
    first_sample,
    setpoints,
    ends,
    values,
    slopes,
    first,
    grid,
    grid_row,
    kinds,
    settings,
    states,
    columns,
    counts,
    scratch,
    begins,
    bounds,
    applied,
    memory,
    measured,
    command,
    kept,
    kept_applied,
    kept_states,
    new_ends,
    new_values,
    new_slopes,
    times,
    rows,
    samples,
    commands,
    progress,
    budget,
):
    """Run the intervals until the end, an event, or the step limit of one call; a status.

    integrate, slots, places, clock, count, y  entry point of the integrator, its slots, the places
                                               in them of ends, values, slopes, times and rows; its
                                               clock, counts and state
    outputs, c, o, measured_at  printed outputs; where each measured column stands among states and
                                outputs
    sample(measured, setpoints, memory, low, high, period, parameters, command, memory)  address of
        the controller; 0: the kernel pauses at each sample, and its caller writes the commands
    edges (K + 1,), ulps (K + 1,), setpoints (K, s)  intervals; samples begin with number
                                                     `first_sample`
    ends .. slopes, first (K + 1,), grid, grid_row (K + 1,)  segments and output times, and the
        first of each interval
    kinds .. begins  drivers (D, ..) and their workspace
    memory (2, ..)  of the last completed interval, and of the present one
    kept, kept_applied, kept_states  state, inputs and drivers at the end of the last completed
                                     interval
    new_ends .. rows  buffers: segments, times and rows of the run, with the instants that drivers
                      add
    samples (K, ..), commands (K, ..)  measurements and commands of every interval
    progress      see `kernel_layout.Progress`
    """
    intervals = edges.shape[0] - 1
    driven = kinds.shape[0]
    steps_at_call = count[2]
    while progress[INTERVAL] < intervals:
        k = progress[INTERVAL]
        begin = edges[k]
        end = edges[k + 1]
        if progress[RUNNING] == 0:
            wanted = grid_row[k + 1] - grid_row[k]
            at_segment = first[k]
            at_row = grid_row[k]
            pieces = first[k + 1] - first[k]
            if progress[WAITING] != DRIVERS:
                progress[FULL] = (
                    1 if driven and is_full(progress, columns, wanted, new_ends, times) else 0
                )
                if progress[FULL] == 1 or count[2] - steps_at_call >= budget:
                    return PAUSED
                status = take_sample(
                    outputs,
                    y,
                    applied,
                    c,
                    o,
                    measured_at,
                    sample,
                    setpoints[k],
                    low,
                    high,
                    period,
                    parameters,
                    k >= first_sample,
                    memory,
                    measured,
                    command,
                    progress,
                )
                if status == DONE:
                    apply_sample(
                        k,
                        measured,
                        samples,
                        command,
                        commands,
                        commanded_at,
                        first,
                        values,
                        progress,
                    )
                    status = drive_inputs(
                        kinds,
                        settings,
                        kept_states,
                        states,
                        columns,
                        counts,
                        scratch,
                        begin,
                        ulps[k + 1],
                        ends,
                        values,
                        slopes,
                        at_segment,
                        pieces,
                        progress,
                    )
                if status != DONE:
                    return status
            progress[WAITING] = NOTHING
            if driven:
                at_segment = progress[SEGMENTS]
                at_row = progress[ROWS]
                pieces, wanted = merge_inputs(
                    columns,
                    counts,
                    begins,
                    begin,
                    new_ends,
                    new_values,
                    new_slopes,
                    at_segment,
                    grid,
                    grid_row[k],
                    grid_row[k + 1],
                    1e-9 * period[0],
                    times,
                    at_row,
                )
            start_integrator(
                slots,
                places,
                progress,
                clock,
                count,
                begin,
                at_segment,
                pieces,
                at_row,
                wanted,
                new_ends,
                new_values,
                new_slopes,
                times,
                rows,
            )
        status = call_integrator(integrate, slots, progress)
        progress[ROWS] = progress[FIRST_ROW] + count[1]
        if status != DONE:
            return status
        if is_below(y, bounds):
            return BELOW_LIMIT
        end_interval(
            progress,
            begin,
            end,
            new_ends,
            new_values,
            new_slopes,
            applied,
            kept_applied,
            y,
            kept,
            memory,
            states,
            kept_states,
        )
    return DONE
