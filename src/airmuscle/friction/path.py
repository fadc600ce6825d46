"""Forces along a path of numbers, row by row: what `replay` is made of. Straight from row to row, so exactly.

Programs never see this file, so it may use NumPy.
"""

from __future__ import annotations

import itertools
import math  # noqa: TID251  (no symbol comes here)
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np  # noqa: TID251  (no symbol comes here)

from ..core.arrays import Array

CURVE_NODES, CURVE_END = 4801, 24.0
"""Nodes of the curve of `autonomous`, and the -ln((1 - w)/2) at which it ends: 1 - w is 8e-11 there (chosen)."""


def _increments(displacement: Any) -> Array:
    path = np.asarray(displacement, dtype=float)
    return np.diff(path, prepend=path[:1])


def compute_speed(displacement: Any, time: Any) -> Array:
    """Speed [m/s] on the way to every row; 0 in the first, and where no time passed."""
    moves, spans = _increments(displacement), _increments(time)
    return np.divide(moves, spans, out=np.zeros_like(moves), where=spans > 0)


def deflection(displacement: Any, travel: Any) -> Array:
    """z [m] along a path x that starts at z = 0, where dz/dx = 1 - z sgn dx/travel; shape (N,).

    `travel` [m] is one for the whole path, or one for the way to each row.
    """
    moves = _increments(displacement)
    kept, goals = np.exp(-np.abs(moves) / travel).tolist(), (np.sign(moves) * travel).tolist()
    found, bend = [], 0.0
    for keep, goal in zip(kept, goals, strict=True):
        bend = goal + (bend - goal) * keep if goal else bend
        found.append(bend)
    return np.array(found)


def stop_operators(displacement: Any, limits: Sequence[float]) -> Array:
    """The stop operators of these limits along a path, shape (N, limits): each follows x, held within -r..r."""
    high = np.asarray(limits, dtype=float)
    moves = _increments(displacement)
    found, bend = np.empty((moves.size, high.size)), np.zeros(high.size)
    for row, move in zip(found, moves, strict=True):
        np.minimum(bend + move, high, out=bend)
        np.maximum(bend, -high, out=bend)
        row[:] = bend
    return found


def relative_deflection(bending: Callable[[Any, Any], Any], displacement: Any, travel: float) -> Array:
    """w along a path x that starts at w = 0, where dw/dx = bending(w, +-1)/travel and |w| < 1; shape (N,).

    The law must be odd, bending(w, -1) = -bending(-w, 1): then all motion runs along one curve w(xi), and turning
    round puts -w on it. The curve is integrated from dxi = dw/bending(w, 1) and interpolated, to 1e-6 for
    the sharpest laws and 1e-8 for the usual ones.
    """
    moves = _increments(displacement) / travel
    share_at, place_of = _loading_curve(bending)
    found, place, heading = np.zeros(moves.size), place_of(0.0), 1.0
    for part, way in _monotone_intervals(moves):
        if way != heading:
            place, heading = place_of(-float(share_at(place))), way
        places = place + np.cumsum(np.abs(moves[part]))
        place = float(places[-1])
        found[part] = heading * share_at(places)
    return found


def _monotone_intervals(moves: Array) -> list[tuple[slice, float]]:
    """The stretches of a path between its turning points, each with its sign; rests belong to what went before."""
    ways = np.sign(moves)
    moving = np.flatnonzero(ways)
    turns = [i for before, i in itertools.pairwise(moving) if ways[i] != ways[before]]
    ends = [0, *turns, moves.size]
    return [(slice(a, b), float(ways[a:b][ways[a:b] != 0][0]) if ways[a:b].any() else 1.0)
            for a, b in itertools.pairwise(ends)]  # fmt: skip


def _loading_curve(bending: Callable[[Any, Any], Any]) -> tuple[Callable[[Any], Any], Callable[[float], float]]:
    """w at a place xi, and the place of a w, on the curve from w = -1 at xi = 0 towards w = 1.

    Its parameter is s = -ln((1 - w)/2), evenly spaced, so that the slow approach to 1 is as fine as the rest.
    """
    from scipy.interpolate import CubicHermiteSpline

    s = np.linspace(0.0, CURVE_END, CURVE_NODES)
    s[np.searchsorted(s, math.log(2.0))] = math.log(2.0)  # a node at w = 0, where powers of |w| have their kink
    points, weights = np.polynomial.legendre.leggauss(5)
    half = np.diff(s) / 2.0
    inner = s[:-1, None] + half[:, None] * (1.0 + points)
    places = np.concatenate([[0.0], np.cumsum((_curve_derivative(bending, inner) @ weights) * half)])
    slopes = _curve_derivative(bending, s)
    forward, back = CubicHermiteSpline(places, s, 1.0 / slopes), CubicHermiteSpline(s, places, slopes)

    def share_at(place: Any) -> Any:
        return 1.0 - 2.0 * np.exp(-forward(np.minimum(place, places[-1])))

    def place_of(share: float) -> float:
        return float(back(min(-math.log(max((1.0 - share) / 2.0, math.exp(-CURVE_END))), CURVE_END)))

    return share_at, place_of


def _curve_derivative(bending: Callable[[Any, Any], Any], s: Array) -> Array:
    """dxi/ds on the curve."""
    share = 1.0 - 2.0 * np.exp(-s)
    return np.asarray((1.0 - share) / bending(share, 1.0))
