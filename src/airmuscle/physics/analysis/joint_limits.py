"""Limits of the stiffness of a joint whose muscles are taut and balance a torque."""

from __future__ import annotations

import numpy as np

from ...core.arrays import Array
from .joint_torque import TorqueFunction

LEVELS = 129
"""Number of pressures of each muscle at which the reachable stiffnesses are evaluated (chosen)."""
BISECTIONS = 50
"""Bisections of the pressure at which a muscle becomes taut; they reach rounding precision."""


def taut_branch(function: TorqueFunction, angle: Array, levels: Array) -> tuple[Array, Array]:
    """Torque and stiffness (N, LEVELS) at pressures from that at which the muscle becomes taut, to the maximum."""
    (tension,) = function(angle[:, None], levels, "tension")
    taut = tension > 0.0
    slack = np.where(taut.any(axis=1), taut.argmax(axis=1), 0)
    start = _first_taut(function, angle, levels[np.maximum(slack - 1, 0)], levels[slack])
    inner = start[:, None] + np.linspace(0.0, 1.0, LEVELS) * (levels[-1] - start)[:, None]
    torque, stiffness = function(angle[:, None], inner, "torque", "stiffness")
    invalid = (~taut.any(axis=1)).reshape(-1, 1)
    return np.where(invalid, np.nan, torque), np.where(invalid, np.nan, stiffness)


def _first_taut(function: TorqueFunction, angle: Array, low: Array, high: Array) -> Array:
    """Least pressure (N,) at which a muscle is taut, by bisection from a slack one to a taut one.

    It is on the taut side, because the stiffness of a slack muscle is zero.
    """
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        taut = function(angle, middle, "tension")[0] > 0.0
        low, high = np.where(taut, low, middle), np.where(taut, middle, high)
    return high


def stiffness_range(pairs: list[tuple[Array, Array]], row: int, torque: float) -> tuple[float, float]:
    """Extreme stiffnesses along the pressures of two taut muscles whose torques sum to `torque`; NaN without one."""
    sums = []
    for (own, own_k), (other, other_k) in (pairs, pairs[::-1]):
        order = np.argsort(other[row])
        x, k = other[row][order], other_k[row][order]
        needed = torque - own[row]
        inside = (needed >= x[0]) & (needed <= x[-1])
        sums.append(own_k[row][inside] + np.interp(needed[inside], x, k))
    both = np.concatenate(sums)
    return (float(both.min()), float(both.max())) if both.size else (np.nan, np.nan)
