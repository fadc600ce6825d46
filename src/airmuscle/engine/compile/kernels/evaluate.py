"""Kernels that evaluate compiled functions: at rows, at many plants, and around a step that is taken by hand."""

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(error_model="numpy", nogil=True)
def evaluate(function: Any, c: Any, states: Any, inputs: Any, results: Any) -> None:
    """Fill results (N, k) with function(x, u, c, o) at states (N, n) and inputs (N, m), all C-contiguous."""
    for row in range(states.shape[0]):
        invoke(function, (pointer(states[row]), pointer(inputs[row]), pointer(c), pointer(results[row])))


@numba.njit(error_model="numpy", nogil=True)
def evaluate_rates(function: Any, precomputed: Any, inputs: Any, states: Any, rates: Any) -> None:
    """Fill rates (N, K, n) with function(x, u, c, f) at K states (N, K, n) of each of N plants, all C-contiguous.

    precomputed (N, c) is what the function needs of each plant's parameters, inputs (m,) are the same for all.
    """
    for plant in range(states.shape[0]):
        for place in range(states.shape[1]):
            here, there = states[plant, place], rates[plant, place]
            invoke(function, (pointer(here), pointer(inputs), pointer(precomputed[plant]), pointer(there)))


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
