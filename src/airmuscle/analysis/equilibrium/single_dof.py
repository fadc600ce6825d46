"""Where plants with one coordinate are in balance, sought over the whole reach of their muscles."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from .roots import balances
from .statics import Rows, Statics

GRID_POINTS = 101
"""Places that are evaluated between the ends of the reach."""


def equilibria_of_one_coordinate(statics: Statics) -> tuple[Rows, Array]:
    """The row of its plant and the place (1,) of every balance, by row and place; plants in balance anywhere or
    without any place have none."""
    x = grid(statics)
    line = Line(statics)
    f = line.accelerations(x)
    plain = np.flatnonzero(((f != 0.0) & np.isfinite(f)).any(axis=1))
    if not plain.size:
        return plain, np.empty((0, 1))
    found, place = balances(line if plain.size == len(f) else line.of(plain), x[plain], f[plain])
    return plain[found], place[:, None]


@dataclasses.dataclass(frozen=True, eq=False)
class Line:
    """Plants as functions of their one coordinate, at one place each (N,) or at several (N, K)."""

    statics: Statics

    def of(self, rows: Rows) -> Line:
        """Some of the plants."""
        return Line(self.statics.of(rows))

    def accelerations(self, x: Array) -> Array:
        """Acceleration from rest."""
        return self.statics.accelerations(x.reshape(len(x), -1, 1)).reshape(x.shape)

    def contractions(self, x: Array) -> list[Array]:
        """Contraction [1] of every muscle (N, K) at places (N, K)."""
        return self.statics.contractions(x[..., None])

    def within_reach(self, x: Array) -> npt.NDArray[np.bool_]:
        """Whether every muscle can take its contraction at places (N, K)."""
        return self.statics.within_reach(x[..., None])


def grid(statics: Statics) -> Array:
    """Coordinates (N, K) that every muscle can take, rising; NaN at the end of a row that has fewer."""
    line = Line(statics)
    low, high, straight = _ends_where_straight(line)
    x = np.linspace(low, high, GRID_POINTS, axis=1)
    x[~(low < high)] = np.nan
    if straight.all():
        return x
    curved = np.flatnonzero(~straight)
    part = _inside(line.of(curved))
    rows = np.full((len(x), max(part.shape[1], GRID_POINTS)), np.nan)
    rows[:, :GRID_POINTS] = x
    rows[curved] = np.nan
    rows[curved, : part.shape[1]] = part
    return rows


def _ends_where_straight(line: Line) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Both ends of the reach (N,), and whether contractions are linear functions of the coordinate."""
    size, low, high = line.statics.limits(0)
    straight = np.ones(size.shape, dtype=bool)
    at = [line.contractions(k * size) for k in (0.0, 1.0, -3.0)]
    for zero, one, other, reach in zip(*at, line.statics.contraction_limits, strict=True):
        rate = (one - zero) / size
        straight &= np.abs(other - (zero - 3.0 * size * rate)) <= 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [(end - zero) / rate for end in reach]
        low = np.where(rate == 0.0, low, np.maximum(low, np.minimum(*ends)))
        high = np.where(rate == 0.0, high, np.minimum(high, np.maximum(*ends)))
    return low[:, 0], high[:, 0], straight[:, 0]


def _inside(line: Line) -> Array:
    """Of evenly spread places those within reach, and both ends of every stretch of them; then NaN."""
    _, low, high = line.statics.limits(0)
    with np.errstate(invalid="ignore"):
        x = np.linspace(low[:, 0], high[:, 0], GRID_POINTS, axis=1)
    inside = line.within_reach(x)
    rows, i = np.nonzero(inside[:, :-1] != inside[:, 1:])
    first = inside[rows, i]
    edges = _edges(line.of(rows), *(np.where(first, x[rows, i + k], x[rows, i + 1 - k]) for k in (0, 1)))
    columns = np.full((len(x), np.bincount(rows, minlength=1).max(initial=0)), np.nan)
    columns[rows, np.arange(rows.size) - np.searchsorted(rows, rows)] = edges
    places = np.sort(np.hstack([np.where(inside, x, np.nan), columns]), axis=1)
    places[:, 1:][np.diff(places, axis=1) == 0.0] = np.nan
    return np.sort(places, axis=1)


def _edges(line: Line, inside: Array, outside: Array) -> Array:
    """The last place (R,) within reach between one that is and one that is not."""
    for _ in range(60 if inside.size else 0):
        middle = 0.5 * (inside + outside)
        there = line.within_reach(middle[:, None])[:, 0]
        inside, outside = np.where(there, middle, inside), np.where(there, outside, middle)
    return inside
