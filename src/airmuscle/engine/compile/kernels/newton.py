"""Newton's method on a printed function g(x, p) = target of as many equations as unknowns."""

from __future__ import annotations

from typing import Any

import numba

from ....core.diagnostics import Status
from .calls import invoke, pointer
from .parts import PART

DONE, SINGULAR = Status.DONE.value, Status.SINGULAR.value
NOT_FINITE, NOT_CONVERGED = Status.NOT_FINITE.value, Status.NOT_CONVERGED.value
MAX_ITERATIONS, MAX_STEP, TOLERANCE = 50, 10.0, 1e-11
"""Iterations; the longest step and the step that ends the search, both in sizes of the unknowns."""


@PART
def scale_equations(by_x: Any, values: Any, target: Any, sizes: Any, a: Any, b: Any) -> None:
    """Write the linear equations a s = b of the step s in sizes, each divided by its largest coefficient."""
    n = b.shape[0]
    for i in range(n):
        largest = 0.0
        for k in range(n):
            a[i, k] = by_x[i, k] * sizes[k]
            largest = max(largest, abs(a[i, k]))
        scale = 1.0 / largest if largest > 0.0 else 1.0
        b[i] = (target[i] - values[i]) * scale
        for k in range(n):
            a[i, k] *= scale


@PART
def eliminate(a: Any, b: Any) -> Any:
    """Reduce the equations to an upper triangle, with row pivoting; whether the matrix is regular."""
    n, regular = b.shape[0], True
    for column in range(n):
        pivot = column
        for i in range(column + 1, n):
            if abs(a[i, column]) > abs(a[pivot, column]):
                pivot = i
        if not abs(a[pivot, column]) > 1e-14:  # also where it is not a number
            regular = False
            break
        for k in range(n):
            a[column, k], a[pivot, k] = a[pivot, k], a[column, k]
        b[column], b[pivot] = b[pivot], b[column]
        for i in range(column + 1, n):
            share = a[i, column] / a[column, column]
            for k in range(column, n):
                a[i, k] -= share * a[column, k]
            b[i] -= share * b[column]
    return regular


@PART
def substitute_back(a: Any, b: Any) -> Any:
    """Solve the upper triangle in place of `b`; the largest step in sizes."""
    n, step = b.shape[0], 0.0
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
        step = max(step, abs(b[i]))
    return step


@numba.njit(nogil=True, error_model="numpy")
def newton(
    function: Any, p: Any, target: Any, sizes: Any, x: Any, values: Any, by_x: Any, by_p: Any, a: Any, b: Any
) -> Any:
    """Move `x` (n,) to the root; `values` (n,), `by_x` (n, n) and `by_p` (n, m) hold the last results of the function.

    function(x, p, values, by_x, by_p)  its address
    a, b  (n, n), (n,): workspace
    Returns a status; b[0] is the last step in sizes.
    """
    n = x.shape[0]
    status = NOT_CONVERGED
    step = 0.0
    for _ in range(MAX_ITERATIONS):
        invoke(function, (pointer(x), pointer(p), pointer(values), pointer(by_x), pointer(by_p)))
        scale_equations(by_x, values, target, sizes, a, b)
        if not eliminate(a, b):
            return SINGULAR
        step = substitute_back(a, b)
        if not step < 1e300:
            return NOT_FINITE
        share = min(1.0, MAX_STEP / max(step, 1e-300))
        large = 1.0
        for i in range(n):
            x[i] += share * sizes[i] * b[i]
            large = max(large, abs(x[i] / sizes[i]))
        if step < TOLERANCE * large:
            status = DONE
            break
    b[0] = step
    return status
