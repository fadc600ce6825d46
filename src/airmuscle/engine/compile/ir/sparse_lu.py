"""Symbolic sparse factorisation L D U of d I - J without pivoting; L and U have unit diagonals.

With unit diagonals, the two substitutions are separated by one multiplication by 1/D, which is
independent for all states: the latency of a solution is determined by the longest chain of
dependent operations, not by their number.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from ....core import Node, nodes

Place = tuple[int, int]


def distinct(expressions: Sequence[Node]) -> tuple[list[Node], tuple[int, ...]]:
    """The distinct expressions, and the index of each given expression among them.

    A system with its sensitivities has equal diagonal blocks: they are computed and factorised
    once.
    """
    first: dict[Any, int] = {}
    merged: list[Node] = []
    slots = []
    for expression in expressions:
        key = nodes.identity(expression)
        if key not in first:
            first[key] = len(merged)
            merged.append(expression)
        slots.append(first[key])
    return merged, tuple(slots)


class Factors:
    """The factors of d I - J; `places` are the non-zero elements of J, `slots` the indices of their
    distinct values.

    `values` are the distinct factors as expressions of `d` and of the symbols `j` of the distinct
    values of J.
    """

    def __init__(self, places: Sequence[Place], slots: Sequence[int], size: int) -> None:
        count = max(slots, default=-1) + 1
        self.j = nodes.symbols("j", count)
        self.d = nodes.symbol("d")
        matrix: dict[Place, Node] = {(i, i): self.d for i in range(size)}
        for slot, place in zip(slots, places, strict=True):
            before = matrix.get(place, nodes.ZERO)
            matrix[place] = before - self.j[slot]
        self.order = _order(matrix, size)
        _factorise(matrix, self.order)
        self.values, slots_of_factors = distinct(list(matrix.values()))
        self._slots = dict(zip(matrix, slots_of_factors, strict=True))

    def solved(self, factors: Any, right: Sequence[Any]) -> list[Any]:
        """x with (d I - J) x = right; `factors[k]` is the k-th of the distinct factors."""
        at = {place: factors[slot] for place, slot in self._slots.items()}
        x = list(right)

        def subtract(i: int, columns: Iterable[int]) -> None:
            for k in columns:
                factor = at.get((i, k))
                if factor is not None:
                    x[i] = x[i] - factor * x[k]

        for n, i in enumerate(self.order):
            subtract(i, self.order[:n])
        for i, value in enumerate(x):
            x[i] = value * at[i, i]
        backward = self.order[::-1]
        for n, i in enumerate(backward):
            subtract(i, backward[:n])
        return x


def _factorise(a: dict[Place, Node], order: Sequence[int]) -> None:
    """Replace the matrix by L below the diagonal (in the given order), U above it, and the inverse
    of D on it.
    """
    for n, k in enumerate(order):
        later = order[n + 1 :]
        inverse = a[k, k] = 1 / a[k, k]
        row = {j: a[k, j] for j in later if (k, j) in a}
        for i in later:
            if (i, k) not in a:
                continue
            factor = a[i, k] * inverse
            a[i, k] = factor
            for j, value in row.items():
                before = a.get((i, j), nodes.ZERO)
                a[i, j] = before - factor * value
        for j, value in row.items():
            a[k, j] = value * inverse


def _order(places: Iterable[Place], size: int) -> tuple[int, ...]:
    """The order of elimination: the state with the smallest possible fill-in (Markowitz criterion),
    then with the shortest chain of eliminations before it, so that independent ones run in
    parallel."""
    rows: list[set[int]] = [set() for _ in range(size)]
    columns: list[set[int]] = [set() for _ in range(size)]
    for i, j in places:
        if i != j:
            rows[i].add(j)
            columns[j].add(i)
    depth = [0] * size
    left = set(range(size))
    order = []

    def merit(i: int) -> tuple[int, int, int]:
        fill_in = len(rows[i]) * len(columns[i])
        return fill_in, depth[i], i

    while left:
        k = min(left, key=merit)
        order.append(k)
        left.remove(k)
        for i in columns[k]:
            rows[i] = (rows[i] | rows[k]) - {i, k}
            depth[i] = max(depth[i], depth[k] + 1)
        for j in rows[k]:
            columns[j] = (columns[j] | columns[k]) - {j, k}
    return tuple(order)
