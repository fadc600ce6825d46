"""Kernel: a compiled function of state and inputs at every row."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(error_model="numpy", nogil=True)
def evaluate(function: Any, c: Any, states: Any, inputs: Any, results: Any) -> None:
    """Fill results (N, k) with function(x, u, c, o) at states (N, n) and inputs (N, m), all C-contiguous."""
    for row in range(states.shape[0]):
        invoke(function, (pointer(states[row]), pointer(inputs[row]), pointer(c), pointer(results[row])))
