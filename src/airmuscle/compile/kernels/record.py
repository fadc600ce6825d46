"""Kernel: outputs and inputs at the rows of a run, and the range of every column."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


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
    for i in range(n + m + k):
        lower[i], upper[i] = 1e308 * 10.0, -1e308 * 10.0
    segment, last, first_bad = 0, ends.shape[0] - 1, count
    start = begin
    for row in range(count):
        while segment < last and ends[segment] <= times[row]:
            start = ends[segment]
            segment += 1
        for i in range(m):
            inputs[row, i] = values[segment, i] + (times[row] - start) * slopes[segment, i]
        if k > 0:
            invoke(function, (pointer(states[row]), pointer(inputs[row]), pointer(c), pointer(outputs[row])))
        for i in range(k):
            x = outputs[row, i]
            if not abs(x) <= 1.7976931348623157e308 and first_bad == count:
                first_bad = row
            lower[n + m + i], upper[n + m + i] = min(lower[n + m + i], x), max(upper[n + m + i], x)
        for i in range(n):
            x = states[row, i]
            lower[i], upper[i] = min(lower[i], x), max(upper[i], x)
        for i in range(m):
            x = inputs[row, i]
            lower[n + i], upper[n + i] = min(lower[n + i], x), max(upper[n + i], x)
    return first_bad
