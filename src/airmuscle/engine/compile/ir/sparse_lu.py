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
        self.j = nodes.symbols("j", max(slots, default=-1) + 1)
        self.d = nodes.symbol("d")
        a: dict[Place, Node] = {(i, i): self.d for i in range(size)}
        for slot, place in zip(slots, places, strict=True):
            a[place] = a.get(place, nodes.ZERO) - self.j[slot]
        self.order = _order(a, size)
        _factorise(a, self.order)
        self.values, slot_of_each = distinct(list(a.values()))
        self._slots = dict(zip(a, slot_of_each, strict=True))

    def solved(self, factors: Any, right: Sequence[Any]) -> list[Any]:
        """x with (d I - J) x = right; `factors[k]` is the k-th of the distinct factors."""
        at = {place: factors[slot] for place, slot in self._slots.items()}
        x = list(right)
        order = self.order
        for n, i in enumerate(order):
            for k in order[:n]:
                if (i, k) in at:
                    x[i] = x[i] - at[i, k] * x[k]
        x = [value * at[i, i] for i, value in enumerate(x)]
        for n, i in reversed(list(enumerate(order))):
            for k in reversed(order[n + 1 :]):
                if (i, k) in at:
                    x[i] = x[i] - at[i, k] * x[k]
        return x


def _factorise(a: dict[Place, Node], order: Sequence[int]) -> None:
    """Replace the matrix by L below the diagonal (in the given order), U above it, and the inverse
    of D on it.
    """
    for n, k in enumerate(order):
        later = order[n + 1 :]
        a[k, k] = 1 / a[k, k]
        row = {j: a[k, j] for j in later if (k, j) in a}
        for i in later:
            if (i, k) not in a:
                continue
            a[i, k] = a[i, k] * a[k, k]
            for j, value in row.items():
                a[i, j] = a.get((i, j), nodes.ZERO) - a[i, k] * value
        for j, value in row.items():
            a[k, j] = value * a[k, k]


def _order(places: Iterable[Place], size: int) -> tuple[int, ...]:
    """The order of elimination: the state with the smallest possible fill-in (Markowitz criterion),
    then with the shortest chain of eliminations before it, so that independent ones run in
    parallel."""
    rows = [{j for i, j in places if i == k and j != k} for k in range(size)]
    columns = [{i for i, j in places if j == k and i != k} for k in range(size)]
    depth, left, order = [0] * size, set(range(size)), []
    while left:
        k = min(left, key=lambda i: (len(rows[i]) * len(columns[i]), depth[i], i))
        order.append(k)
        left.remove(k)
        for i in columns[k]:
            rows[i] = (rows[i] | rows[k]) - {i, k}
            depth[i] = max(depth[i], depth[k] + 1)
        for j in rows[k]:
            columns[j] = (columns[j] | columns[k]) - {j, k}
    return tuple(order)
