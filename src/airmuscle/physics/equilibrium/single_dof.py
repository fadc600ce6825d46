"""Equilibria of plants with one coordinate: grid over the permitted range, and roots between its
points.
"""

import functools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ...core import Array
from .statics import Rows, Statics

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
JUMP = 1e-6
"""Residual at a root relative to the median of all points; with a greater residual, the sign
changes by a discontinuity (chosen)."""
CLOSE = 1e-13
"""Step at which a root search ends, relative to the initial interval; the remaining error is far
smaller (chosen).
"""
GRID_POINTS = 101
"""Number of points that are evaluated between the ends of the range."""


def equilibria_of_one_coordinate(statics: Statics) -> tuple[Rows, Array]:
    """Row of the plant and coordinate (1,) of every equilibrium, sorted by row and coordinate.

    Plants in equilibrium at every point of the grid, or without a permitted point, have none.
    """
    x = grid(statics)
    f = _accelerations(statics, x)
    plain = np.flatnonzero(((f != 0.0) & np.isfinite(f)).any(axis=1))
    if not plain.size:
        return plain, np.empty((0, 1))
    balanced, place = balances(
        statics if plain.size == len(f) else statics.of(plain), x[plain], f[plain]
    )
    return plain[balanced], place[:, None]


def _places(x: Array) -> Array:
    """Values of the one coordinate, (N,) or (N, K), as coordinates (N, K, 1) of the plants."""
    return x.reshape(len(x), -1, 1)


def _accelerations(plants: Statics, x: Array) -> Array:
    """Acceleration from rest at one point each (N,) or at several (N, K)."""
    return plants.accelerations(_places(x)).reshape(x.shape)


def grid(statics: Statics) -> Array:
    """Permitted coordinates (N, K) in ascending order; rows with fewer than K end with NaN."""
    low, high, linear = _ends_if_linear(statics)
    x = np.linspace(low, high, GRID_POINTS, axis=1)
    x[~(low < high)] = np.nan
    if linear.all():
        return x
    nonlinear = np.flatnonzero(~linear)
    part = _inside(statics.of(nonlinear))
    rows = np.full((len(x), max(part.shape[1], GRID_POINTS)), np.nan)
    rows[:, :GRID_POINTS] = x
    rows[nonlinear] = np.nan
    rows[nonlinear, : part.shape[1]] = part
    return rows


def _ends_if_linear(plants: Statics) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Both ends of the range (N,), and whether the contractions are linear functions of the
    coordinate.
    """
    size, low, high = plants.limits(0)
    linear = np.ones(size.shape, dtype=bool)
    at = [plants.contractions(_places(k * size)) for k in (0.0, 1.0, -3.0)]
    for zero, unit, opposite, reach in zip(*at, plants.contraction_limits, strict=True):
        rate = (unit - zero) / size
        linear &= np.abs(opposite - (zero - 3.0 * size * rate)) <= 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [(end - zero) / rate for end in reach]
        low = np.where(rate == 0.0, low, np.maximum(low, np.minimum(*ends)))
        high = np.where(rate == 0.0, high, np.minimum(high, np.maximum(*ends)))
    return low[:, 0], high[:, 0], linear[:, 0]


def _inside(plants: Statics) -> Array:
    """Permitted points of an even grid, and both ends of every interval of them; then NaN."""
    _, low, high = plants.limits(0)
    with np.errstate(invalid="ignore"):
        x = np.linspace(low[:, 0], high[:, 0], GRID_POINTS, axis=1)
    inside = plants.within_reach(_places(x))
    rows, i = np.nonzero(inside[:, :-1] != inside[:, 1:])
    first = inside[rows, i]
    edges = _edges(
        plants.of(rows), *(np.where(first, x[rows, i + k], x[rows, i + 1 - k]) for k in (0, 1))
    )
    columns = np.full((len(x), np.bincount(rows, minlength=1).max(initial=0)), np.nan)
    columns[rows, np.arange(rows.size) - np.searchsorted(rows, rows)] = edges
    places = np.sort(np.hstack([np.where(inside, x, np.nan), columns]), axis=1)
    places[:, 1:][np.diff(places, axis=1) == 0.0] = np.nan
    return np.sort(places, axis=1)


def _edges(plants: Statics, inside: Array, outside: Array) -> Array:
    """Last permitted coordinate (R,) between a permitted one and one that is not, by bisection."""
    for _ in range(60 if inside.size else 0):
        middle = 0.5 * (inside + outside)
        there = plants.within_reach(_places(middle))[:, 0]
        inside = np.where(there, middle, inside)
        outside = np.where(there, outside, middle)
    return inside


def balances(plants: Statics, x: Array, f: Array) -> tuple[Rows, Array]:
    """Rows of the plants and coordinates of all roots, in ascending order, from accelerations f (N,
    K) at ascending x.

    Roots are the points with f = 0 (both ends of an interval with f = 0), one point between
    neighbours of different sign, and two points where f crosses zero twice between neighbours of
    equal sign.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        zero = np.pad(f == 0.0, ((0, 0), (1, 1)))
        exact = zero[:, 1:-1] & ~(zero[:, :-2] & zero[:, 2:])
        crossing = f[:, :-1] * f[:, 1:] < 0.0
        # of three neighbours of equal sign, the second is nearest to zero
        a, b, c = (np.sign(f[:, k : k + max(f.shape[1] - 2, 0)]) for k in range(3))
        one_sign = (a == b) & (b == c) & (b != 0.0)
        a, b, c = (np.abs(f[:, k : k + max(f.shape[1] - 2, 0)]) for k in range(3))
        nearing = one_sign & (b <= np.minimum(a, c)) & (b < np.maximum(a, c))
    rows, i = np.nonzero(exact)
    root_parts = [(rows, x[rows, i])]
    rows, i = np.nonzero(crossing)
    root_parts.append(_roots(plants, f, rows, x[rows, i], x[rows, i + 1]))
    rows, i = np.nonzero(nearing)
    around = np.stack([x[rows, i + k] for k in range(3)])
    root_parts += _pairs(plants, f, rows, around, np.sign(f[rows, i + 1]))
    row, place = (np.concatenate(parts) for parts in zip(*root_parts, strict=True))
    order = np.lexsort((place, row))
    return row[order], place[order]


def _roots(plants: Statics, f: Array, rows: Rows, low: Array, high: Array) -> tuple[Rows, Array]:
    """The roots between points of different sign; there is none where the function passes through
    infinity.
    """
    if not rows.size:
        return rows, low
    there = plants.of(rows)
    root = between(there, low, high)
    left = np.abs(_accelerations(there, root))
    size = np.abs(f)[rows]
    continuous = left <= JUMP * np.nanmin(size, axis=1)
    doubtful = np.flatnonzero(~continuous)
    continuous[doubtful] = left[doubtful] <= JUMP * np.nanmedian(size[doubtful], axis=1)
    return rows[continuous], root[continuous]


def between(plants: Statics, low: Array, high: Array) -> Array:
    """The roots between points (R,) of different sign by the false position method (Illinois
    variant).
    """
    at_low = _accelerations(plants, low)
    at_high = _accelerations(plants, high)
    last = low
    close = np.maximum(CLOSE * (high - low), np.spacing(np.maximum(np.abs(low), np.abs(high))))
    rows = np.arange(low.size)
    roots = low.copy()
    ended = np.zeros(low.size, dtype=bool)
    for _ in range(200):
        with np.errstate(all="ignore"):
            crossing = low + (high - low) * at_low / (at_low - at_high)
        # an end itself if the root is within its rounding error
        middle = np.where(np.isfinite(crossing), np.clip(crossing, low, high), 0.5 * (low + high))
        at = _accelerations(plants, middle)
        roots[rows] = np.where(ended, roots[rows], middle)
        ended |= (
            (at == 0.0)
            | (np.abs(middle - last) <= close[rows])
            | ~((low < middle) & (middle < high))
        )
        if ended.all():
            break
        replaces_low = (
            at * at_low > 0.0
        )  # the value at an end that is retained twice is halved (Illinois)
        at_low = np.where(replaces_low, at, at_low * np.where(last >= high, 0.5, 1.0))
        at_high = np.where(replaces_low, at_high * np.where(last <= low, 0.5, 1.0), at)
        low = np.where(replaces_low, middle, low)
        high = np.where(replaces_low, high, middle)
        last = middle
        if 2 * ended.sum() > ended.size:  # continue with the unfinished rows only
            unfinished = np.flatnonzero(~ended)
            plants = plants.of(unfinished)
            rows = rows[unfinished]
            ended = ended[unfinished]
            low, high, at_low, at_high, last = (
                v[unfinished] for v in (low, high, at_low, at_high, last)
            )
    return roots


def _pairs(
    plants: Statics, f: Array, rows: Rows, x: Array, sign: Array
) -> list[tuple[Rows, Array]]:
    """The two roots between three points x (3, R) of equal sign, if the function crosses zero twice
    there.
    """
    if not rows.size:
        return []
    turn = _across(functools.partial(_accelerations, plants.of(rows)), x[0], x[2], sign)
    there = np.isfinite(turn)
    rows = rows[there]
    x = x[:, there]
    turn = turn[there]
    return [_roots(plants, f, rows, low, high) for low, high in ((x[0], turn), (turn, x[2]))]


def _across(function: Callable[[Array], Array], low: Array, high: Array, sign: Array) -> Array:
    """A point between two at which the function has the opposite sign, by golden-section search;
    NaN without one.
    """
    inner = np.stack([high - GOLDEN * (high - low), low + GOLDEN * (high - low)])
    values = np.stack([sign * function(v) for v in inner])
    turn = np.full(low.shape, np.nan)
    for _ in range(50):
        least = np.where(values[1] < values[0], inner[1], inner[0])
        turn = np.where(np.isnan(turn) & (values.min(axis=0) < 0.0), least, turn)
        if np.isfinite(turn).all():
            break
        left = values[0] < values[1]
        low = np.where(left, low, inner[0])
        high = np.where(left, inner[1], high)
        retained = np.where(left, inner[0], inner[1])
        of_kept = np.where(left, values[0], values[1])
        asked = np.where(left, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        at = sign * function(asked)
        inner = np.stack([np.where(left, asked, retained), np.where(left, retained, asked)])
        values = np.stack([np.where(left, at, of_kept), np.where(left, of_kept, at)])
    return turn
