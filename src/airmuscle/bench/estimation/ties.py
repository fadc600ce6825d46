"""Ties: candidates whose criterion differs by less than `TIE` are equal, and their order does not
depend on the last digits.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from ...core import Array

Item = TypeVar("Item")
TIE = 1e-6
"""Relative difference of a criterion below which two candidates are equal (chosen)."""


def first_greatest(values: Array) -> int:
    """The index of the greatest of values (N,), the first of equal ones."""
    greatest = float(np.max(values))
    return int(np.argmax(values >= greatest - TIE * abs(greatest)))


def tied_groups(items: Sequence[Item], criterion: Callable[[Item], float]) -> list[list[Item]]:
    """The items by ascending criterion, those that are equal to the first of a group in one
    group.
    """
    groups: list[list[Item]] = []
    for item in sorted(items, key=criterion):
        value = criterion(item)
        first = criterion(groups[-1][0]) if groups else value
        is_equal = value == first or value - first <= TIE * max(abs(first), abs(value))
        if groups and is_equal:
            groups[-1].append(item)
        else:
            groups.append([item])
    return groups


def in_order(
    items: Sequence[Item], criterion: Callable[[Item], float], then: Callable[[Item], Any]
) -> list[Item]:
    """The items by ascending criterion, and those that are equal by `then`, else as they were."""
    places = {id(item): place for place, item in enumerate(items)}
    ordered = []
    for group in tied_groups(items, criterion):
        ordered += sorted(group, key=lambda item: (then(item), places[id(item)]))
    return ordered
