"""Products and factors of small matrices, as parts of kernels; numba copies them into the kernel."""

from __future__ import annotations

from math import sqrt
from typing import Any

from ....core.diagnostics import Status
from .parts import PART

DONE, SINGULAR = Status.DONE.value, Status.SINGULAR.value


@PART
def multiply(a: Any, b: Any, result: Any) -> None:
    """The product of `a` (n, k) and `b` (k, m) in `result` (n, m)."""
    for i in range(result.shape[0]):
        for j in range(result.shape[1]):
            value = 0.0
            for k in range(b.shape[0]):
                value += a[i, k] * b[k, j]
            result[i, j] = value


@PART
def add_product(a: Any, b: Any, result: Any) -> None:
    """Add the product of the first n columns of `a` and of `b` (n, m) to `result` (n, m); zeros of `a` are skipped."""
    n = result.shape[0]
    for i in range(n):
        for k in range(n):
            if a[i, k] != 0.0:
                for j in range(result.shape[1]):
                    result[i, j] += a[i, k] * b[k, j]


@PART
def cholesky(s: Any, factor: Any) -> Any:
    """Lower triangular `factor` (p, p) of a positive definite matrix `s`; a status."""
    for i in range(s.shape[0]):
        for j in range(i + 1):
            value = s[i, j]
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = value / factor[j, j]
            elif value > 0.0:
                factor[i, i] = sqrt(value)
            else:
                return SINGULAR
    return DONE


@PART
def solve_row(factor: Any, row: Any) -> None:
    """Replace `row` (p,) by S^-1 row, where S = L L^T with the factor L."""
    p = factor.shape[0]
    for i in range(p):
        for k in range(i):
            row[i] -= factor[i, k] * row[k]
        row[i] /= factor[i, i]
    for i in range(p - 1, -1, -1):
        for k in range(i + 1, p):
            row[i] -= factor[k, i] * row[k]
        row[i] /= factor[i, i]
