"""Growing arrays of a run in parts: rows that are asked for, and segments of the inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compile.cache.kernel import address_of
from ..core.arrays import Array


class Buffer:
    """Rows of an array that grows at its end; `address` is that of its first number."""

    def __init__(self, width: int | None, capacity: int) -> None:
        self._row = () if width is None else (width,)
        self.stride = 8 * (1 if width is None else width)
        self.array: Array = np.empty((max(capacity, 1), *self._row))
        self.address = address_of(self.array)
        self.size = 0

    def reserve(self, count: int) -> bool:
        """Make room for so many further rows; whether the array was replaced."""
        needed = self.size + count
        if needed <= len(self.array):
            return False
        longer = np.empty((max(needed, 2 * len(self.array)), *self._row))
        longer[: self.size] = self.array[: self.size]
        self.array = longer
        self.address = address_of(self.array)
        return True

    def append(self, rows: Sequence[float]) -> int:
        """Append rows, given number by number; the index of the first."""
        first = self.size
        width = self._row[0] if self._row else 1
        count = len(rows) // width if width else 0
        self.reserve(count)
        self.array[first : first + count] = rows if not self._row else np.reshape(rows, (count, width))
        self.size += count
        return first

    def at(self, row: int) -> int:
        """The address of a row."""
        return self.address + row * self.stride

    @property
    def rows(self) -> Array:
        """The rows so far."""
        return self.array[: self.size]
