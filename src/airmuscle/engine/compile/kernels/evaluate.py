"""Kernels that evaluate compiled functions: at rows, at many plants, around a step taken by hand,
for a recording.
"""

import numba

from .calls import CONTRACTED_PART, PART, as_vector, invoke, pointer


@numba.njit(error_model="numpy", nogil=True)
def evaluate(function, c, states, inputs, results):
    """Fill results (N, k) with function(x, u, c, o) at states (N, n) and inputs (N, m), all
    C-contiguous.
    """
    for row in range(states.shape[0]):
        invoke(
            function,
            (pointer(states[row]), pointer(inputs[row]), pointer(c), pointer(results[row])),
        )


@numba.njit(error_model="numpy", nogil=True)
def evaluate_rates(function, precomputed, inputs, states, rates):
    """Fill rates (N, K, n) with function(x, u, c, f) at K states (N, K, n) of each of N plants, all
    C-contiguous.

    precomputed (N, c) is what the function needs of each plant's parameters, inputs (m,) are the
    same for all.
    """
    for plant in range(states.shape[0]):
        for place in range(states.shape[1]):
            here = states[plant, place]
            there = rates[plant, place]
            invoke(
                function,
                (pointer(here), pointer(inputs), pointer(precomputed[plant]), pointer(there)),
            )


@numba.njit(error_model="numpy", nogil=True)
def begin_step(given, lower, upper, state, start):
    """Copy the state (n,) into `start`; 1 + the index of the first of the inputs `given` (m,) that
    is not a number within its limits, 0 where all are within."""
    for i in range(state.shape[0]):
        start[i] = state[i]
    for i in range(given.shape[0]):
        if not (lower[i] <= given[i] <= upper[i]):
            return i + 1
    return 0


@numba.njit(error_model="numpy", nogil=True)
def end_step(
    function, c, end, given, values, lower, upper, low, high, state, inputs, outputs, always
):
    """Compute values (k,) by function(x, u, c, o) at `end` (n,) under `given` (m,), and compare
    with the limits.

    lower, upper  (n,): limits of the states; low, high (k,): limits of the outputs
    state, inputs, outputs  take `end`, `given`, `values` where all are within their limits, or
                            `always` (1,) is not 0
    Returns 0 where all numbers are within their limits, else 1 + the index of the first, states
    before outputs.
    """
    n = end.shape[0]
    defect = 0
    invoke(function, (pointer(end), pointer(given), pointer(c), pointer(values)))
    for i in range(n):
        if defect == 0 and not (lower[i] <= end[i] <= upper[i]):
            defect = i + 1
    for i in range(values.shape[0]):
        if defect == 0 and not (low[i] <= values[i] <= high[i]):
            defect = n + i + 1
    if defect == 0 or always[0] != 0:
        for i in range(n):
            state[i] = end[i]
        for i in range(given.shape[0]):
            inputs[i] = given[i]
        for i in range(values.shape[0]):
            outputs[i] = values[i]
    return defect


@PART
def _find_range(table, column, lower, upper, place):
    """Smallest and largest value of a column of a table (N, k), into `place`; one that is not a
    number is passed over.

    Four rows at a time, because a comparison waits for the one before it.
    """
    count = table.shape[0]
    quarters = count // 4
    low = low1 = low2 = low3 = 1e308 * 10.0
    high = high1 = high2 = high3 = -1e308 * 10.0
    for four in range(quarters):
        row = 4 * four
        a = table[row, column]
        b = table[row + 1, column]
        c = table[row + 2, column]
        d = table[row + 3, column]
        low = min(low, a)
        low1 = min(low1, b)
        low2 = min(low2, c)
        low3 = min(low3, d)
        high = max(high, a)
        high1 = max(high1, b)
        high2 = max(high2, c)
        high3 = max(high3, d)
    for row in range(4 * quarters, count):
        a = table[row, column]
        low = min(low, a)
        high = max(high, a)
    lower[place] = min(low, low1, low2, low3)
    upper[place] = max(high, high1, high2, high3)


@PART
def _rows_before(times, row, end):
    """The first row from `row` on that is not before `end`, found in growing and then in shrinking
    strides.
    """
    count = times.shape[0]
    stride = 1
    if row >= count or times[row] >= end:
        return row
    while row + stride < count and times[row + stride] < end:
        row += stride
        stride *= 2
    while stride > 1:
        stride //= 2
        if row + stride < count and times[row + stride] < end:
            row += stride
    return row + 1


@PART
def _evaluate(function, c, states, inputs, outputs, x, u, o):
    """Outputs (N, k) at states (N, n) and inputs (N, m), W rows at once; x, u, o (W, ...) hold the
    last block.
    """
    width = x.shape[0]
    count = states.shape[0]
    rest = 0
    while rest + width <= count:
        invoke(
            function,
            (pointer(states[rest]), pointer(inputs[rest]), pointer(c), pointer(outputs[rest])),
        )
        rest += width
    if rest < count:
        for lane in range(width):
            row = min(rest + lane, count - 1)
            for i in range(states.shape[1]):
                x[lane, i] = states[row, i]
            for i in range(inputs.shape[1]):
                u[lane, i] = inputs[row, i]
        invoke(function, (pointer(x), pointer(u), pointer(c), pointer(o)))
        for row in range(rest, count):
            for i in range(outputs.shape[1]):
                outputs[row, i] = o[row - rest, i]


@numba.njit(error_model="numpy", nogil=True)
def record(
    function,
    c,
    states,
    times,
    begin,
    ends,
    values,
    slopes,
    inputs,
    outputs,
    columns,
    lower,
    upper,
    x,
    u,
    o,
):
    """Fill inputs (N, m) and outputs (N, k) at states (N, n) and rising times (N,); the first row
    that is not finite.

    function(x, u, c, o)  address of the outputs at W rows: `outputs` of a program, or its
                          `row_outputs`
    begin, ends, values, slopes  beginning of the first segment, and as in `rodas4`; of a row where
                                 two segments meet the inputs are those that begin there
    columns      (r,) numbers of the columns whose range is wanted: of a state i, of an output n + i
    lower, upper (r,): smallest and largest value of each of these columns
    x, u, o      (W, n), (W, m), (W, k): workspace
    Returns N where all outputs are finite.
    """
    count = times.shape[0]
    n = states.shape[1]
    m = values.shape[1]
    k = outputs.shape[1]
    segment = 0
    last = ends.shape[0] - 1
    start = begin
    row = 0
    while row < count:
        while segment < last and ends[segment] <= times[row]:
            start = ends[segment]
            segment += 1
        first = row
        row = _rows_before(times, row + 1, ends[segment]) if segment < last else count
        for i in range(m):
            value = values[segment, i]
            slope = slopes[segment, i]
            for place_of_time in range(first, row):
                inputs[place_of_time, i] = value + (times[place_of_time] - start) * slope
    if k > 0:
        _evaluate(function, c, states, inputs, outputs, x, u, o)
    for place in range(columns.shape[0]):
        column = columns[place]
        if column < n:
            _find_range(states, column, lower, upper, place)
        else:
            _find_range(outputs, column - n, lower, upper, place)
    # one vector, because rows are short
    all_outputs = as_vector(outputs)
    defects = 0
    for i in range(all_outputs.size):
        defects += not abs(all_outputs[i]) <= 1.7976931348623157e308
    if defects == 0:
        return count
    for row in range(count):
        for i in range(k):
            if not abs(outputs[row, i]) <= 1.7976931348623157e308:
                return row
    return count


@CONTRACTED_PART
def set_inputs(base, elapsed, w, u):
    """The inputs `u` so long after the start of a segment, where they were `base`; they move at
    `w`.
    """
    for i in range(u.shape[0]):
        u[i] = base[i] + elapsed * w[i]


@CONTRACTED_PART
def write_present(times, row, t, y, rows):
    """Write the present states at the output times up to `t`; the next row."""
    while row < times.shape[0] and times[row] <= t:
        for i in range(y.shape[0]):
            rows[row, i] = y[i]
        row += 1
    return row
