"""Kernel: outputs and inputs at the rows of a run, and the range of every column."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(error_model="numpy", nogil=True, inline="always")
def _find_ranges(table: Any, lower: Any, upper: Any) -> Any:
    """Smallest and largest value of every column of a table (N, k); 0 where all are finite, else not a number.

    Four rows at a time, because a comparison waits for the one before it. A value that is not a number is passed over.
    """
    count = table.shape[0]
    whole = count // 4
    defect = 0.0
    for i in range(table.shape[1]):
        low = low1 = low2 = low3 = 1e308 * 10.0
        high = high1 = high2 = high3 = -1e308 * 10.0
        sum0 = sum1 = sum2 = sum3 = 0.0
        for four in range(whole):
            row = 4 * four
            a, b, c, d = table[row, i], table[row + 1, i], table[row + 2, i], table[row + 3, i]
            low, low1, low2, low3 = min(low, a), min(low1, b), min(low2, c), min(low3, d)
            high, high1, high2, high3 = max(high, a), max(high1, b), max(high2, c), max(high3, d)
            sum0, sum1, sum2, sum3 = sum0 + (a - a), sum1 + (b - b), sum2 + (c - c), sum3 + (d - d)
        for row in range(4 * whole, count):
            a = table[row, i]
            low, high, sum0 = min(low, a), max(high, a), sum0 + (a - a)
        lower[i] = min(low, low1, low2, low3)
        upper[i] = max(high, high1, high2, high3)
        defect += (sum0 + sum1) + (sum2 + sum3)
    return defect


@numba.njit(error_model="numpy", nogil=True)
def record(
    function: Any, c: Any, states: Any, times: Any, begin: Any, ends: Any, values: Any, slopes: Any,
    inputs: Any, outputs: Any, lower: Any, upper: Any,
) -> Any:  # fmt: skip
    """Fill inputs (N, m) and outputs (N, k) at states (N, n) and rising times (N,); the first row that is not finite.

    function(x, u, c, o)  address of the outputs
    begin, ends, values, slopes  beginning of the first segment, and as in `rodas4`; of a row where two segments meet
                 the inputs are those that begin there
    lower, upper (n + m + k,): smallest and largest value of every column, states first, then inputs, then outputs
    Returns N where all outputs are finite.
    """
    count, n, m, k = times.shape[0], states.shape[1], values.shape[1], outputs.shape[1]
    segment, last = 0, ends.shape[0] - 1
    start = begin
    for row in range(count):
        while segment < last and ends[segment] <= times[row]:
            start = ends[segment]
            segment += 1
        for i in range(m):
            inputs[row, i] = values[segment, i] + (times[row] - start) * slopes[segment, i]
        if k > 0:
            invoke(function, (pointer(states[row]), pointer(inputs[row]), pointer(c), pointer(outputs[row])))
    _find_ranges(states, lower[:n], upper[:n])
    _find_ranges(inputs, lower[n : n + m], upper[n : n + m])
    if _find_ranges(outputs, lower[n + m :], upper[n + m :]) == 0.0:
        return count
    for row in range(count):
        for i in range(k):
            if not abs(outputs[row, i]) <= 1.7976931348623157e308:
                return row
    return count
