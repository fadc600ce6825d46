"""Parts of the kernel of a sampled loop: the segments of an interval's inputs, passed through their
drivers.

A signal of an input is an array (3, capacity): end, value at the start, and slope of each segment.
"""

from ..kernel_layout import DriverKind, Progress
from .calls import PART
from .drivers import delayed_switch, pulse_width_modulation

MODULATOR = DriverKind.MODULATOR.value
SEGMENTS = int(Progress.SEGMENTS)
ROWS = int(Progress.ROWS)


@PART
def is_full(progress, columns, wanted, new_ends, times):
    """Whether the buffers have no room for the segments and rows that drivers may add in an
    interval.
    """
    room = columns.shape[2] * columns.shape[0]
    return (
        progress[SEGMENTS] + room > new_ends.shape[0]
        or progress[ROWS] + room + wanted > times.shape[0]
    )


@PART
def load_columns(ends, values, slopes, first, pieces, columns, counts):
    """Copy the segments of an interval to the signals of the inputs."""
    for i in range(columns.shape[0]):
        counts[0, i] = pieces
        for row in range(pieces):
            columns[i, 0, row] = ends[first + row]
            columns[i, 1, row] = values[first + row, i]
            columns[i, 2, row] = slopes[first + row, i]


@PART
def find_piece(ends, last, piece, time):
    """The number of the segment in which a time lies, from `piece` to `last`; where two meet, the
    later one.
    """
    while piece < last and ends[piece] <= time:
        piece += 1
    return piece


@PART
def setpoints_at(ends, setpoint_values, setpoint_slopes, last, start, piece, time, setpoint):
    """Write the set points at a time, of a signal that begins at `start`; the number of its
    segment.
    """
    piece = find_piece(ends, last, piece, time)
    begin = ends[piece - 1] if piece > 0 else start
    for i in range(setpoint.shape[0]):
        setpoint[i] = setpoint_values[piece, i] + (time - begin) * setpoint_slopes[piece, i]
    return piece


@PART
def cut_segments(
    ends, given_values, given_slopes, last, start, piece, begin, end, command, commanded, columns
):
    """Write the signals of the inputs from `begin` to `end`; commands are held.

    Returns the number of the segment at the end, and how many segments each signal has.

    An exported program calls it where a run of the library has cut the segments of all intervals
    before its start.
    """
    count = 0
    time = begin
    while time < end:
        piece = find_piece(ends, last, piece, time)
        origin = ends[piece - 1] if piece > 0 else start
        following = end
        if piece < last:
            following = min(end, ends[piece])
        for i in range(columns.shape[0]):
            columns[i, 0, count] = following
            columns[i, 1, count] = given_values[piece, i] + (time - origin) * given_slopes[piece, i]
            columns[i, 2, count] = given_slopes[piece, i]
        for j in range(command.shape[0]):
            columns[commanded[j], 1, count] = command[j]
            columns[commanded[j], 2, count] = 0.0
        count += 1
        time = following
    return piece, count


@PART
def apply_drivers(kinds, settings, states, later, columns, counts, scratch, start, ulp):
    """Pass the signals of inputs, columns (m, 3, capacity) with their counts (m,), through their
    drivers (D,).

    kinds (D, 2)  input and kind of each driver, in the order of the signal
    states        of each driver; `later` receives those at the end of the signals, and may be the
                  same array
    ulp           distance from the end of the signals to the next floating-point number
    scratch       (2, 3, capacity): workspace
    """
    for d in range(kinds.shape[0]):
        i = kinds[d, 0]
        if kinds[d, 1] == MODULATOR:
            count = pulse_width_modulation(
                settings[d], states[d], later[d], columns[i], counts[i], start, ulp, scratch[0]
            )
        else:
            count = delayed_switch(
                settings[d],
                states[d],
                later[d],
                columns[i],
                counts[i],
                start,
                scratch[1],
                scratch[0],
            )
        for part in range(3):
            for k in range(count):
                columns[i, part, k] = scratch[0, part, k]
        counts[i] = count


@PART
def merge_columns(columns, counts, at, begins, start, ends, values, slopes, first):
    """Write the signals of all inputs as common segments from number `first` on; how many there
    are.

    at (m,), begins (m,)  workspace: the present segment of each input and its start
    """
    inputs = columns.shape[0]
    for i in range(inputs):
        at[i] = 0
        begins[i] = start
    end = columns[0, 0, counts[0] - 1]
    time = start
    segments = 0
    while True:
        following = end
        row = first + segments
        for i in range(inputs):
            while at[i] < counts[i] - 1 and columns[i, 0, at[i]] <= time:
                begins[i] = columns[i, 0, at[i]]
                at[i] += 1
            values[row, i] = columns[i, 1, at[i]] + (time - begins[i]) * columns[i, 2, at[i]]
            slopes[row, i] = columns[i, 2, at[i]]
            if at[i] < counts[i] - 1:
                following = min(following, columns[i, 0, at[i]])
        ends[row] = following
        segments += 1
        if not following < end:
            return segments
        time = following


@PART
def merge_times(grid, begin, end, instants, first, count, close, times, row):
    """Write the rows `begin` to `end` of a grid and the instants in rising order from `row` on; how
    many there are.

    A row of the grid within `close` of an instant is replaced by it.
    """
    written = 0
    k = begin
    for i in range(first, first + count):
        while k < end and grid[k] < instants[i] - close:
            times[row + written] = grid[k]
            written += 1
            k += 1
        times[row + written] = instants[i]
        written += 1
        while k < end and grid[k] <= instants[i] + close:
            k += 1
    while k < end:
        times[row + written] = grid[k]
        written += 1
        k += 1
    return written


@PART
def merge_inputs(
    columns,
    counts,
    begins,
    begin,
    new_ends,
    new_values,
    new_slopes,
    at_segment,
    grid,
    grid_begin,
    grid_end,
    close,
    times,
    at_row,
):
    """Merge the signals of an interval behind the drivers; the numbers of segments and of output
    times that result.
    """
    driven = merge_columns(
        columns, counts[0], counts[1], begins, begin, new_ends, new_values, new_slopes, at_segment
    )
    instants = driven if driven > 1 else 0
    wanted = merge_times(
        grid, grid_begin, grid_end, new_ends, at_segment, instants, close, times, at_row
    )
    return driven, wanted
