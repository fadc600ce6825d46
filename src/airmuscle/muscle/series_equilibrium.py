"""Where the contractile part of a muscle comes to rest behind its series spring."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..core import autodiff
from ..core.arrays import Array
from ..core.ops import Value

if TYPE_CHECKING:
    from .muscle import Muscle

CLOSE = 1e-15
"""Contractions that differ by less than this are one (chosen, a few roundings)."""
MOST = 200


def settled_inside(muscle: Muscle, pressure: Value, contraction: Value) -> Value:
    """Contraction [1] at which the contractile part pulls as much as the series spring holds, at a gauge pressure [Pa]
    and a contraction [1] of the fittings; arrays broadcast, and the muscle's parameters may be arrays too.

    What is out of balance falls from one end of the bracket to the other, so there is one such place. Where the part
    pushes itself apart and the spring hangs slack, it is the place at which it no longer does.
    """
    unbalance = _unbalance(muscle)
    length, stiffness = muscle.geometry.resting_length, getattr(muscle.series, "stiffness", np.inf)
    least, most = muscle.geometry.contraction_range
    pull, _ = unbalance(pressure, contraction, contraction)
    here = contraction + np.zeros(np.shape(pull))
    stretched = np.minimum(here + np.maximum(pull, 0.0) / (stiffness * length), np.maximum(most, here))
    low = np.where(np.less(pull, 0.0), np.minimum(least, here), here)
    high = np.where(np.less(pull, 0.0), here, stretched)
    found = last_pulling(lambda inner: unbalance(pressure, inner, contraction), low, high, here)
    return found if found.ndim else float(found)


def _unbalance(muscle: Muscle) -> Callable[[Value, Value, Value], tuple[Array, Array]]:
    """What is out of balance inside and its slope by the inner contraction, which is not known of a law that is not
    closed-form."""
    if muscle.contractile.traceable and muscle.geometry.traceable:
        return autodiff.value_and_derivative(muscle, "internal_imbalance", 3, wrt=1)

    def without_slope(pressure: Value, inner: Value, contraction: Value) -> tuple[Array, Array]:
        value = np.asarray(muscle.internal_imbalance(pressure, inner, contraction), dtype=float)
        return value, np.full(value.shape, np.nan)

    return without_slope


def last_pulling(function: Callable[[Array], tuple[Array, Array]], low: Array, high: Array, start: Array) -> Array:
    """The greatest x between `low` and `high` at which a falling function, given with its slope, is not below zero.

    Newton's method from `start` inside the bracket, which is halved where a step would leave it or is more than half of
    the step before.
    """
    x, before, found = start, high - low, start
    searching = np.ones(np.shape(start), dtype=bool)
    for _ in range(MOST):
        value, slope = function(x)
        low, high = np.where(np.greater_equal(value, 0.0), x, low), np.where(np.greater_equal(value, 0.0), high, x)
        with np.errstate(all="ignore"):
            step = -np.divide(value, slope)  # not a number on a stretch at zero, whose far end is meant
        newton = (x + step >= low) & (x + step <= high)
        close = newton & (np.abs(step) <= CLOSE)
        middle = 0.5 * (low + high)
        ahead = np.where(close | (newton & (2.0 * np.abs(step) <= np.abs(before))), x + step, middle)
        before, x = ahead - x, ahead
        found = np.where(searching, x, found)
        searching &= ~close & (high - low > CLOSE)
        if not searching.any():
            break
    return found
