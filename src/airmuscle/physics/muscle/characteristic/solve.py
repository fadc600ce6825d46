"""Root search for the directions of a characteristic that are not in closed form."""

import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from ....core import AirmuscleWarning, SolveError, TraceError, ops
from .modes import formula_alone, is_unsolved_nan

INTERVALS = 256
"""Intervals of the search grid; a pair of roots within 1/256 of the search range is not
resolved.
"""
_TOLERANCES = {"xatol": 0.0, "xrtol": 4 * float(np.finfo(float).eps), "fatol": 0.0, "frtol": 0.0}


def check_numbers(*values: Any) -> None:
    """Raise TraceError for values of a traced program: those within `jax.jit`, and symbols."""
    jax = sys.modules.get("jax")
    for value in values:
        is_array_of_jax = type(value).__module__.partition(".")[0] in ("jax", "jaxlib")
        has_numbers = is_array_of_jax and not isinstance(value, jax.core.Tracer)  # type: ignore[union-attr]
        if ops.is_traced(value) and not has_numbers:
            raise TraceError(
                "this direction of the characteristic is not in closed form: its root search needs"
                f" numbers, but {type(value).__name__} is a value of a traced program. Call it"
                " outside of jax.jit, or use a direction that the characteristic gives in closed"
                " form."
            )


def as_arrays(*values: Any) -> tuple[Any, ...]:
    """The values as arrays of numbers of one shape. Raises TraceError for traced values."""
    check_numbers(*values)
    return tuple(np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in values)))


def warn_above_whole_length(contraction: Any, owner: object) -> None:
    """Issue an AirmuscleWarning for contractions [1] above 1: probably percentages. Traced values
    are not checked.
    """
    if ops.is_traced(contraction):
        return
    values = np.asarray(contraction, dtype=float)
    largest = float(np.max(values, initial=0.0, where=~np.isnan(values)))
    if largest > 1.0:
        hint = (
            f" Is it in per cent? As a ratio it is {largest / 100:g}." if largest <= 100.0 else ""
        )
        warnings.warn(
            f"{type(owner).__name__}: a contraction of {largest:g} exceeds the whole length of the"
            f" muscle; it is a ratio of lengths.{hint}",
            AirmuscleWarning,
            stacklevel=3,
        )


def describe_range(low: float, high: float, unit: str) -> str:
    """Return a range as text with four significant digits; rounding residues become 0, missing
    limits a dash.
    """
    if np.isnan(low) or np.isnan(high):
        return "–"
    size = max(abs(low), abs(high))
    low, high = (0.0 if abs(limit) < 1e-9 * size else limit for limit in (low, high))
    return f"{low:.4g} to {high:.4g} {unit}"


def find_first_root(
    function: Callable[[Any, Any, Any], Any],
    bounds: tuple[float, float],
    args: tuple[Any, Any],
    message: Callable[[float, float, float, float], str],
) -> Any:
    """Return the smallest x within `bounds` at which `function(x, a, b)` changes from negative to
    zero or positive.

    This is the branch reached from rest as x increases. `args` are the two other quantities a and
    b, scalars or arrays that broadcast; the result has their shape. Raises SolveError for the first
    pair without a root, with the text of `message(a, b, minimum, maximum)`, where minimum and
    maximum are the extreme values of `function` within `bounds`; in `values_or_nan` such a pair
    gives NaN. Raises TraceError for traced values, which have no numbers.
    """
    with formula_alone():
        return _find_first_root(function, bounds, args, message)


def _find_first_root(
    function: Callable[[Any, Any, Any], Any],
    bounds: tuple[float, float],
    args: tuple[Any, Any],
    message: Callable[[float, float, float, float], str],
) -> Any:
    from scipy.optimize import elementwise

    first, second = as_arrays(*args)
    a, b = first.reshape(-1), second.reshape(-1)
    grid = np.linspace(*bounds, INTERVALS + 1)
    with np.errstate(
        over="ignore", invalid="ignore"
    ):  # a model may overflow far from its solutions
        values = np.asarray(function(grid[:, None], a, b)) + np.zeros((grid.size, a.size))
    rises = (values[:-1] < 0) & (values[1:] >= 0)
    at_start = values[0] == 0
    unsolved = ~(rises.any(axis=0) | at_start)
    if unsolved.any() and not is_unsolved_nan():
        first_unsolved = int(np.argmax(unsolved))
        finite = values[~np.isnan(values[:, first_unsolved]), first_unsolved]
        extremes = (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)
        raise SolveError(message(float(a[first_unsolved]), float(b[first_unsolved]), *extremes))
    roots = np.where(unsolved, np.nan, bounds[0])
    index = rises.argmax(axis=0)
    plateau = np.take_along_axis(values, index[None, :] + 1, axis=0)[0] == 0

    def sign(x: Any, *others: Any) -> Any:
        """The sign of the function, so that the search finds the edge of a plateau at zero (a
        clamped force).
        """
        return np.where(np.asarray(function(x, *others)) >= 0, 1.0, -1.0)

    for subset, target in ((~plateau, function), (plateau, sign)):
        selected = subset & ~at_start & ~unsolved
        if selected.any():
            bracket = (grid[index[selected]], grid[index[selected] + 1])
            with np.errstate(over="ignore", invalid="ignore"):
                given = (a[selected], b[selected])
                root = elementwise.find_root(
                    target, bracket, args=given, tolerances=_TOLERANCES, maxiter=200
                )
            roots[selected] = root.x
    return float(roots[0]) if first.ndim == 0 else roots.reshape(first.shape)


_SCALES = {"N": 1.0, "%": 100.0, "kPa": 1e-3}
"""Factors from SI of the units in messages."""


def solve_direction(
    response: Callable[[Any, Any, Any], Any],
    bounds: tuple[float, float],
    given: tuple[Any, Any],
    wanted: int,
    message: Callable[[float, float], str],
    available: str,
    unit: str,
    *,
    falling: bool = False,
) -> Any:
    """The smallest x within `bounds` at which `response(x, a, b)` is number `wanted` of the given
    values a and b.

    The response rises with x unless it is `falling`. `message(a, b)` begins the text of the
    SolveError where there is no solution; it ends with the range of the response in a unit, called
    `available`.
    """

    def residual(x: Any, *values: Any) -> Any:
        target = values[wanted]
        return target - response(x, *values) if falling else response(x, *values) - target

    def text(a: float, b: float, low: float, high: float) -> str:
        target = (a, b)[wanted]
        scale = _SCALES[unit]
        ends = (target - high, target - low) if falling else (low + target, high + target)
        return (
            f"{message(a, b)}{available}: {describe_range(scale * ends[0], scale * ends[1], unit)}."
        )

    return find_first_root(residual, bounds, given, text)


def check_solution(
    solution: Any,
    bounds: tuple[float, float],
    args: tuple[Any, Any],
    message: Callable[[float, float], str],
) -> Any:
    """Return `solution`, the result of a closed form; raises SolveError(message(a, b)) if it is not
    within `bounds`.

    `args` are the two other quantities a and b. Symbols and JAX arrays have no values and are not
    checked. In `values_or_nan` a solution outside is NaN.
    """
    if ops.is_traced(solution):
        return solution
    values = np.asarray(solution, dtype=float)
    outside = ~((values >= bounds[0]) & (values <= bounds[1]))
    if outside.any() and is_unsolved_nan():
        return np.where(outside, np.nan, values)
    if outside.any():
        first, second = (
            np.broadcast_to(np.asarray(v, dtype=float), values.shape)[outside].flat[0] for v in args
        )
        raise SolveError(message(float(first), float(second)))
    return solution
