"""Array type: NumPy arrays of double-precision floats."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""A NumPy array of float64."""
NUMBERS = frozenset({float, int, np.float64})
"""Types of numbers that need no conversion."""
FEW = 64
"""Numbers up to which a Python loop is faster than NumPy (measured)."""


def as_slice(rows: npt.NDArray[np.intp]) -> slice | npt.NDArray[np.intp]:
    """Ascending indices as a slice where they are successive, which copies no rows."""
    if rows.size and rows[-1] - rows[0] + 1 == rows.size:
        return slice(int(rows[0]), int(rows[-1]) + 1)
    return rows


def all_finite(values: Array) -> bool:
    """Whether all numbers of an array are finite."""
    if values.size > FEW:
        return bool(np.isfinite(values).all())
    return all(map(math.isfinite, values.ravel().tolist()))


def flat_view(array: npt.NDArray[Any]) -> Any:
    """A view of a C-contiguous array whose items are read and written as plain numbers, faster than those of NumPy."""
    items: Any = array.reshape(-1)
    return memoryview(items)
