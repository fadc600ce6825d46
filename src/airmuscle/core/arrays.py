"""Arrays of double-precision floats, and the threads of linear algebra."""

import contextlib
import ctypes
import math
import os
from collections.abc import Iterator
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
    """A view of a C-contiguous array whose items are read and written as plain numbers, faster than
    those of NumPy.
    """
    items: Any = array.reshape(-1)
    return memoryview(items)


BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that limit the threads of linear algebra, which a process reads when it
loads the library.
"""


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """One thread for the linear algebra of this process, unless the environment states a number.

    NumPy and SciPy load a copy of OpenBLAS each. Without effect for another library.
    """
    from numpy.linalg import _umath_linalg
    from scipy.linalg import _fblas

    before = []
    stated = any(name in os.environ for name in BLAS_THREADS)
    for module, suffix in () if stated else ((_umath_linalg, "64_"), (_fblas, "")):
        with contextlib.suppress(OSError, AttributeError):
            library = ctypes.CDLL(module.__file__)
            get, limit = (
                getattr(library, f"scipy_openblas_{verb}_num_threads{suffix}")
                for verb in ("get", "set")
            )
            before.append((limit, get()))
    try:
        for limit, _ in before:
            limit(1)
        yield
    finally:
        for limit, count in before:
            limit(count)
