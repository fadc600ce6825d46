"""Approximation of functions of time by connected straight lines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.arrays import Array
from ...core.declaration import as_float
from ...core.errors import ParameterError

INITIAL_LINES = 64
"""Straight lines that a sampled function is first approximated by (chosen)."""
MAX_POINTS = 100_000
"""Points of a sampled function."""


def approximate(
    name: str, function: Callable[[float], float], start: float, end: float, error: float
) -> tuple[tuple[float, float], ...]:
    """Points of a function whose connecting lines stay within `error` of it."""
    if not (0 < error < np.inf and -np.inf < start < end < np.inf):
        raise ParameterError(
            f"the sampled signal of '{name}': from {start!r} to {end!r} s within {error!r}; the error and the duration "
            "must be greater than 0."
        )
    times = np.linspace(start, end, INITIAL_LINES + 1)
    values = _evaluate(name, function, times)
    while True:
        lengths = np.diff(times)
        between = times[:-1] + np.array([[0.25], [0.5], [0.75]]) * lengths
        exact = _evaluate(name, function, between.ravel()).reshape(between.shape)
        errors = np.abs(exact - np.interp(between, times, values)).max(axis=0)
        at = np.flatnonzero(errors > error)
        if at.size == 0:
            return tuple(zip(times.tolist(), values.tolist(), strict=True))
        if times.size + at.size > MAX_POINTS or lengths[at].min() < 1e-9 * (end - start):
            raise ParameterError(
                f"the sampled signal of '{name}' is not approximated to {error:g} by {times.size} points: the error is "
                f"{errors.max():g} at {times[np.argmax(errors)]:g} s. Allow a larger error; give a function that jumps "
                "as a Schedule."
            )
        times, values = np.insert(times, at + 1, between[1, at]), np.insert(values, at + 1, exact[1, at])


def _evaluate(name: str, function: Callable[[float], float], times: Array) -> Array:
    """A function of time at times (N,). Raises ParameterError where it gives no finite number."""
    if not callable(function):
        raise ParameterError(f"the sampled signal of '{name}' is {function!r}; give a function of time [s].")
    values = np.empty(times.size)
    for i, time in enumerate(times.tolist()):
        values[i] = as_float(f"the sampled signal of '{name}' at {time:g} s", function(time))
        if not np.isfinite(values[i]):
            raise ParameterError(f"the sampled signal of '{name}' is {values[i]} at {time:g} s; it must be finite.")
    return values
