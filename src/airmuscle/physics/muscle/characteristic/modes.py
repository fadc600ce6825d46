"""Modes in which laws are evaluated: as their formula also beyond their range, and with NaN in
place of an error where there is no solution.
"""

import contextlib
import contextvars
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np  # noqa: TID251  (points are numbers)

from ....core import Array, PhysicsError

_FORMULA_ALONE = contextvars.ContextVar("formula_alone", default=False)


def is_formula_alone() -> bool:
    """Whether laws are evaluated as their formula, also beyond their range."""
    return _FORMULA_ALONE.get()


@contextlib.contextmanager
def formula_alone() -> Iterator[None]:
    """Within it, laws are their formula: searches and extensions look at a law from inside."""
    token = _FORMULA_ALONE.set(True)
    try:
        yield
    finally:
        _FORMULA_ALONE.reset(token)


_UNSOLVED_AS_NAN = contextvars.ContextVar("unsolved_as_nan", default=False)
"""Whether points without a solution are NaN in the results of the functions below, not an error."""


def is_unsolved_nan() -> bool:
    """Whether points without a solution are NaN, as in `values_or_nan`."""
    return _UNSOLVED_AS_NAN.get()


def values_or_nan(law: Callable[..., Any], *points: Array) -> Array:
    """Values of a law at points (N,), NaN where it has no solution; halves of the points isolate
    those.
    """
    token = _UNSOLVED_AS_NAN.set(True)
    try:
        with np.errstate(all="ignore"):  # a law may be singular at the end of its range
            return np.broadcast_to(np.asarray(law(*points), dtype=float), points[0].shape)
    except PhysicsError:
        if points[0].size == 1:
            return np.array([np.nan])
    finally:
        _UNSOLVED_AS_NAN.reset(token)
    half = points[0].size // 2
    halves = ([each[part] for each in points] for part in (slice(None, half), slice(half, None)))
    return np.concatenate([values_or_nan(law, *each) for each in halves])
