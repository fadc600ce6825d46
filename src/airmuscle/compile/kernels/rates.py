"""The kernel that asks many plants of one structure for their rates, each with parameters of its own."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(cache=True, error_model="numpy", nogil=True)
def rates_of_each(function: Any, held: Any, inputs: Any, states: Any, rates: Any) -> None:
    """Fill rates (N, K, n) with function(x, u, c, f) at K states (N, K, n) of each of N plants, all C-contiguous.

    held (N, c) is what each plant's parameters are to the printed function, inputs (m,) are the same for all.
    """
    for plant in range(states.shape[0]):
        for place in range(states.shape[1]):
            here, there = states[plant, place], rates[plant, place]
            invoke(function, (pointer(here), pointer(inputs), pointer(held[plant]), pointer(there)))
