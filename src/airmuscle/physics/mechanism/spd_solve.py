"""Solution of linear systems with a symmetric positive definite matrix, over `ops`."""

from __future__ import annotations

from collections.abc import Sequence

from ...core.ops import Value


def solve_positive_definite(matrix: Sequence[Sequence[Value]], right: Sequence[Value]) -> list[Value]:
    """Return x of A x = b by the factorisation A = L D L^T without pivoting; A is symmetric and positive definite.

    The values may be numbers, arrays or symbols.
    """
    count = len(right)
    lower: list[list[Value]] = [[0.0] * count for _ in range(count)]
    diagonal: list[Value] = []
    for j in range(count):
        diagonal.append(matrix[j][j] - sum(lower[j][k] ** 2 * diagonal[k] for k in range(j)))
        for i in range(j + 1, count):
            known = sum(lower[i][k] * lower[j][k] * diagonal[k] for k in range(j))
            lower[i][j] = (matrix[i][j] - known) / diagonal[j]
    y: list[Value] = []
    for i in range(count):
        y.append(right[i] - sum(lower[i][k] * y[k] for k in range(i)))
    x = [value / pivot for value, pivot in zip(y, diagonal, strict=True)]
    for i in reversed(range(count)):
        x[i] = x[i] - sum(lower[k][i] * x[k] for k in range(i + 1, count))
    return x
