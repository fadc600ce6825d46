"""Equilibria of plants with one coordinate: grid over the permitted range, and roots between its
points.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

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


class LinearRange(NamedTuple):
    """Both ends of the range (N,), and whether the contractions are linear functions of the
    coordinate; only then are the ends those within the limits of the muscles.
    """

    low: Array
    high: Array
    is_linear: npt.NDArray[np.bool_]


class RootSigns(NamedTuple):
    """Where values (N, K) announce roots: points that are 0 (N, K), neighbours of different sign
    (N, K - 1), and three neighbours of equal sign whose second is nearest to zero (N, K - 2).
    """

    exact: npt.NDArray[np.bool_]
    crossing: npt.NDArray[np.bool_]
    nearing: npt.NDArray[np.bool_]


def _places(x: Array) -> Array:
    """Values of the one coordinate, (N,) or (N, K), as coordinates (N, K, 1) of the plants."""
    return x.reshape(len(x), -1, 1)


def _accelerations(plants: Statics, x: Array) -> Array:
    """Acceleration from rest at one point each (N,) or at several (N, K)."""
    return plants.accelerations(_places(x)).reshape(x.shape)


def grid(statics: Statics) -> Array:
    """Permitted coordinates (N, K) in ascending order; rows with fewer than K end with NaN."""
    low, high, linear = _linear_range(statics)
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


def _linear_range(plants: Statics) -> LinearRange:
    """The range of the coordinate as it follows from two contractions of each muscle; a third one
    shows whether they are linear.
    """
    size, low, high = plants.limits(0)
    linear = np.ones(size.shape, dtype=bool)
    at = [plants.contractions(_places(k * size)) for k in (0.0, 1.0, -3.0)]
    for zero, unit, opposite, reach in zip(*at, plants.contraction_limits, strict=True):
        rate = (unit - zero) / size
        expected = zero - 3.0 * size * rate
        linear &= np.abs(opposite - expected) <= 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = ((end - zero) / rate for end in reach)
        lowest = np.maximum(low, np.minimum(first, second))
        highest = np.minimum(high, np.maximum(first, second))
        # a muscle whose length is constant limits nothing
        is_constant = rate == 0.0
        low = np.where(is_constant, low, lowest)
        high = np.where(is_constant, high, highest)
    return LinearRange(low[:, 0], high[:, 0], linear[:, 0])


def _inside(plants: Statics) -> Array:
    """Permitted points of an even grid, and both ends of every interval of them; then NaN."""
    _, low, high = plants.limits(0)
    with np.errstate(invalid="ignore"):
        x = np.linspace(low[:, 0], high[:, 0], GRID_POINTS, axis=1)
    inside = plants.within_reach(_places(x))
    changes = inside[:, :-1] != inside[:, 1:]
    rows, i = np.nonzero(changes)
    before = x[rows, i]
    after = x[rows, i + 1]
    is_end = inside[rows, i]
    permitted = np.where(is_end, before, after)
    forbidden = np.where(is_end, after, before)
    edges = _edges(plants.of(rows), permitted, forbidden)
    most = np.bincount(rows, minlength=1).max(initial=0)
    number_in_row = np.arange(rows.size) - np.searchsorted(rows, rows)
    columns = np.full((len(x), most), np.nan)
    columns[rows, number_in_row] = edges
    points = np.where(inside, x, np.nan)
    places = np.hstack([points, columns])
    places.sort(axis=1)
    # An edge that is a point of the grid stands once; NaN ends a row, whose number of places
    # differs from that of the others.
    repeated = np.diff(places, axis=1) == 0.0
    places[:, 1:][repeated] = np.nan
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
    signs = _root_signs(f)
    rows, i = np.nonzero(signs.exact)
    root_parts = [(rows, x[rows, i])]
    rows, i = np.nonzero(signs.crossing)
    low = x[rows, i]
    high = x[rows, i + 1]
    root_parts.append(_roots(plants, f, rows, low, high))
    rows, i = np.nonzero(signs.nearing)
    around = np.stack([x[rows, i + k] for k in range(3)])
    sign = np.sign(f[rows, i + 1])
    root_parts += _pairs(plants, f, rows, around, sign)
    row, place = (np.concatenate(parts) for parts in zip(*root_parts, strict=True))
    order = np.lexsort((place, row))
    return row[order], place[order]


def _root_signs(f: Array) -> RootSigns:
    """Where values (N, K) announce roots; NaN announces none."""
    count = max(f.shape[1] - 2, 0)
    before, middle, after = (f[:, k : k + count] for k in range(3))
    one_column_more = (1, 1)
    zero = np.pad(f == 0.0, ((0, 0), one_column_more))
    # of an interval of zeros both ends count
    is_within_zeros = zero[:, :-2] & zero[:, 2:]
    exact = zero[:, 1:-1] & ~is_within_zeros
    with np.errstate(invalid="ignore", over="ignore"):
        # of two neighbours
        products = f[:, :-1] * f[:, 1:]
        crossing = products < 0.0
        nearing = _nears_zero(before, middle, after)
    return RootSigns(exact, crossing, nearing)


def _nears_zero(before: Array, middle: Array, after: Array) -> npt.NDArray[np.bool_]:
    """Where three neighbours have one sign, and the middle one is nearest to zero."""
    sign = np.sign(middle)
    nearing: npt.NDArray[np.bool_] = sign != 0.0
    nearing &= np.sign(before) == sign
    nearing &= np.sign(after) == sign
    size = np.abs(middle)
    size_before = np.abs(before)
    size_after = np.abs(after)
    nearing &= size <= np.minimum(size_before, size_after)
    nearing &= size < np.maximum(size_before, size_after)
    return nearing


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
    length = high - low
    first = high - GOLDEN * length
    second = low + GOLDEN * length
    at_first = sign * function(first)
    at_second = sign * function(second)
    turn = np.full(low.shape, np.nan)
    for _ in range(50):
        least = np.where(at_second < at_first, second, first)
        is_opposite = np.minimum(at_first, at_second) < 0.0
        turn = np.where(np.isnan(turn) & is_opposite, least, turn)
        if np.isfinite(turn).all():
            break
        in_left_part = at_first < at_second
        low = np.where(in_left_part, low, first)
        high = np.where(in_left_part, second, high)
        length = high - low
        retained = np.where(in_left_part, first, second)
        at_retained = np.where(in_left_part, at_first, at_second)
        new = np.where(in_left_part, high - GOLDEN * length, low + GOLDEN * length)
        at_new = sign * function(new)
        first = np.where(in_left_part, new, retained)
        second = np.where(in_left_part, retained, new)
        at_first = np.where(in_left_part, at_new, at_retained)
        at_second = np.where(in_left_part, at_retained, at_new)
    return turn
