"""Kernels around a step that is taken by hand: inputs within their limits before it, outputs and limits after it."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(error_model="numpy", nogil=True)
def begin_step(given: Any, lower: Any, upper: Any, state: Any, start: Any) -> Any:
    """Copy the state (n,) into `start`; 1 + the index of the first of the inputs `given` (m,) that is not a number
    within its limits, 0 where all are within."""
    for i in range(state.shape[0]):
        start[i] = state[i]
    for i in range(given.shape[0]):
        if not (lower[i] <= given[i] <= upper[i]):
            return i + 1
    return 0


@numba.njit(error_model="numpy", nogil=True)
def end_step(
    function: Any, c: Any, end: Any, given: Any, values: Any, lower: Any, upper: Any, low: Any, high: Any,
    state: Any, inputs: Any, outputs: Any, always: Any,
) -> Any:  # fmt: skip
    """Compute values (k,) by function(x, u, c, o) at `end` (n,) under `given` (m,), and compare with the limits.

    lower, upper  (n,): limits of the states; low, high (k,): limits of the outputs
    state, inputs, outputs  take `end`, `given`, `values` where all are within their limits, or `always` (1,) is not 0
    Returns 0 where all numbers are within their limits, else 1 + the index of the first, states before outputs.
    """
    n, defect = end.shape[0], 0
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
