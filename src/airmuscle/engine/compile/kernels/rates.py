"""Kernel: rates of many plants of one structure, each with its own parameters."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(error_model="numpy", nogil=True)
def evaluate_rates(function: Any, precomputed: Any, inputs: Any, states: Any, rates: Any) -> None:
    """Fill rates (N, K, n) with function(x, u, c, f) at K states (N, K, n) of each of N plants, all C-contiguous.

    precomputed (N, c) is what the function needs of each plant's parameters, inputs (m,) are the same for all.
    """
    for plant in range(states.shape[0]):
        for place in range(states.shape[1]):
            here, there = states[plant, place], rates[plant, place]
            invoke(function, (pointer(here), pointer(inputs), pointer(precomputed[plant]), pointer(there)))
