"""The root search behind the directions that a law does not give in closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.errors import SolveError

INTERVALS = 256
"""Places looked at within a reach; a law that rises and falls again within 1/256 of it is not resolved."""

_TOLERANCES = {"xatol": 0.0, "xrtol": 4 * float(np.finfo(float).eps), "fatol": 0.0, "frtol": 0.0}


def find_first_root(
    function: Callable[[Any, Any, Any], Any],
    reach: tuple[float, float],
    given: tuple[Any, Any],
    message: Callable[[float, float, float, float], str],
) -> Any:
    """The smallest x in `reach` where `function(x, a, b)` passes from below zero to zero or more.

    That is the branch reached from rest as x grows. `given` are the two other quantities, scalars or arrays
    that broadcast; the answer has their shape. `message(a, b, lowest, greatest)` words the NoSolution raised for
    the first pair without a crossing, from the least and greatest value that `function` takes in `reach`.
    """
    from scipy.optimize import elementwise

    first, second = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in given))
    a, b = first.reshape(-1), second.reshape(-1)
    grid = np.linspace(*reach, INTERVALS + 1)
    with np.errstate(over="ignore", invalid="ignore"):  # far from any answer a law may overflow
        values = np.asarray(function(grid[:, None], a, b)) + np.zeros((grid.size, a.size))
    rises = (values[:-1] < 0) & (values[1:] >= 0)
    at_start = values[0] == 0
    unsolved = ~(rises.any(axis=0) | at_start)
    if unsolved.any():
        worst = int(np.argmax(unsolved))
        taken = values[~np.isnan(values[:, worst]), worst]
        ends = (float(taken.min()), float(taken.max())) if taken.size else (np.nan, np.nan)
        raise SolveError(message(float(a[worst]), float(b[worst]), *ends))
    found = np.full(a.size, reach[0])
    index = rises.argmax(axis=0)
    plateau = np.take_along_axis(values, index[None, :] + 1, axis=0)[0] == 0
    for chosen, searched in ((~plateau, function), (plateau, _sign_function(function))):
        here = chosen & ~at_start
        if here.any():
            bracket = (grid[index[here]], grid[index[here] + 1])
            with np.errstate(over="ignore", invalid="ignore"):
                root = elementwise.find_root(
                    searched, bracket, args=(a[here], b[here]), tolerances=_TOLERANCES, maxiter=200
                )
            found[here] = root.x
    return float(found[0]) if first.ndim == 0 else found.reshape(first.shape)


def _sign_function(function: Callable[[Any, Any, Any], Any]) -> Callable[[Any, Any, Any], Any]:
    """The function reduced to its side of zero: a plateau at zero (a clamped force) is then searched for its edge."""
    return lambda x, a, b: np.where(np.asarray(function(x, a, b)) >= 0, 1.0, -1.0)


def check_solution(
    found: Any, reach: tuple[float, float], given: tuple[Any, Any], message: Callable[[float, float], str]
) -> Any:
    """`found`, the answer of a closed form, where it lies in `reach`; raises SolveError(message(a, b)) elsewhere.

    `given` are the two other quantities. Symbols and JAX arrays pass, for they have no value to look at.
    """
    if type(found).__module__.partition(".")[0] in ("casadi", "jax", "jaxlib"):
        return found
    values = np.asarray(found, dtype=float)
    outside = ~((values >= reach[0]) & (values <= reach[1]))
    if outside.any():
        first, second = (np.broadcast_to(np.asarray(v, dtype=float), values.shape)[outside].flat[0] for v in given)
        raise SolveError(message(float(first), float(second)))
    return found
