"""Symbolic LU of d I - J, its sparsity worked out while printing; no pivoting."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi

Pattern = tuple[tuple[int, int], ...]


def non_zeros(matrix: Any) -> Pattern:
    """The places of a CasADi matrix that are not structurally zero, row by row."""
    rows, columns = matrix.shape
    return tuple((i, j) for i in range(rows) for j in range(columns) if not matrix[i, j].is_zero())


def distinct(expressions: Sequence[Any]) -> tuple[Any, tuple[int, ...]]:
    """The expressions that differ, as one vector, and where in it each of those given stands.

    A system with its sensitivities repeats one block along the diagonal: it is computed and factorised once.
    """
    merged = casadi.cse(casadi.vertcat(*expressions)) if expressions else casadi.SX(0, 1)
    first: dict[int, int] = {}
    slots = tuple(first.setdefault(merged[i].element_hash(), len(first)) for i in range(len(expressions)))
    return casadi.vertcat(*(merged[slots.index(k)] for k in range(len(first)))), slots


def shifted(jacobian: Pattern, slots: Sequence[int], size: int) -> tuple[list[list[Any]], Any, Any]:
    """d I - J as rows of symbols, with the symbols of J's distinct non-zeros and of d."""
    values, shift = casadi.SX.sym("j", max(slots, default=-1) + 1), casadi.SX.sym("d")
    matrix = [[casadi.SX(0)] * size for _ in range(size)]
    for slot, (i, j) in zip(slots, jacobian, strict=True):
        matrix[i][j] = -values[slot]
    for i in range(size):
        matrix[i][i] = matrix[i][i] + shift
    return matrix, values, shift


def factorised(matrix: list[list[Any]]) -> list[list[Any]]:
    """L and U in one matrix, with the inverse pivots on the diagonal."""
    size = len(matrix)
    a = [list(row) for row in matrix]
    for k in range(size):
        a[k][k] = 1 / a[k][k]
        for i in range(k + 1, size):
            if a[i][k].is_zero():
                continue
            a[i][k] = a[i][k] * a[k][k]
            for j in range(k + 1, size):
                if not a[k][j].is_zero():
                    a[i][j] = a[i][j] - a[i][k] * a[k][j]
    return a


def pattern_of(matrix: list[list[Any]]) -> Pattern:
    """The places of a matrix of expressions that are not structurally zero, row by row."""
    return tuple((i, j) for i, row in enumerate(matrix) for j, x in enumerate(row) if not x.is_zero())


def solved(pattern: Pattern, slots: Sequence[int], factors: Any, right: Sequence[Any]) -> list[Any]:
    """x with L U x = right, from the distinct factors, which stand at the places of `pattern`."""
    size = len(right)
    at = {place: factors[slot] for slot, place in zip(slots, pattern, strict=True)}
    x = list(right)
    for i in range(size):
        for j in range(i):
            if (i, j) in at:
                x[i] = x[i] - at[i, j] * x[j]
    for i in reversed(range(size)):
        for j in range(i + 1, size):
            if (i, j) in at:
                x[i] = x[i] - at[i, j] * x[j]
        x[i] = x[i] * at[i, i]
    return x
