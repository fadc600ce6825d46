"""Equilibria of plants with one coordinate, over the whole permitted range of their muscles."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from .roots import balances
from .statics import Rows, Statics

GRID_POINTS = 101
"""Number of points that are evaluated between the ends of the range."""


def equilibria_of_one_coordinate(statics: Statics) -> tuple[Rows, Array]:
    """Row of the plant and coordinate (1,) of every equilibrium, sorted by row and coordinate.

    Plants in equilibrium at every point of the grid, or without a permitted point, have none.
    """
    x = grid(statics)
    line = Line(statics)
    f = line.accelerations(x)
    plain = np.flatnonzero(((f != 0.0) & np.isfinite(f)).any(axis=1))
    if not plain.size:
        return plain, np.empty((0, 1))
    balanced, place = balances(line if plain.size == len(f) else line.of(plain), x[plain], f[plain])
    return plain[balanced], place[:, None]


@dataclasses.dataclass(frozen=True, eq=False)
class Line:
    """Plants as functions of their one coordinate, at one point each (N,) or at several (N, K)."""

    statics: Statics

    def of(self, rows: Rows) -> Line:
        """Some of the plants."""
        return Line(self.statics.of(rows))

    def accelerations(self, x: Array) -> Array:
        """Acceleration from rest."""
        return self.statics.accelerations(x.reshape(len(x), -1, 1)).reshape(x.shape)

    def contractions(self, x: Array) -> list[Array]:
        """Contraction of every muscle (N, K) at coordinates (N, K)."""
        return self.statics.contractions(x[..., None])

    def within_reach(self, x: Array) -> npt.NDArray[np.bool_]:
        """Whether the contraction of every muscle is permitted at coordinates (N, K)."""
        return self.statics.within_reach(x[..., None])


def grid(statics: Statics) -> Array:
    """Permitted coordinates (N, K) in ascending order; rows with fewer than K end with NaN."""
    line = Line(statics)
    low, high, linear = _ends_if_linear(line)
    x = np.linspace(low, high, GRID_POINTS, axis=1)
    x[~(low < high)] = np.nan
    if linear.all():
        return x
    nonlinear = np.flatnonzero(~linear)
    part = _inside(line.of(nonlinear))
    rows = np.full((len(x), max(part.shape[1], GRID_POINTS)), np.nan)
    rows[:, :GRID_POINTS] = x
    rows[nonlinear] = np.nan
    rows[nonlinear, : part.shape[1]] = part
    return rows


def _ends_if_linear(line: Line) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Both ends of the range (N,), and whether the contractions are linear functions of the coordinate."""
    size, low, high = line.statics.limits(0)
    linear = np.ones(size.shape, dtype=bool)
    at = [line.contractions(k * size) for k in (0.0, 1.0, -3.0)]
    for zero, one, other, reach in zip(*at, line.statics.contraction_limits, strict=True):
        rate = (one - zero) / size
        linear &= np.abs(other - (zero - 3.0 * size * rate)) <= 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [(end - zero) / rate for end in reach]
        low = np.where(rate == 0.0, low, np.maximum(low, np.minimum(*ends)))
        high = np.where(rate == 0.0, high, np.minimum(high, np.maximum(*ends)))
    return low[:, 0], high[:, 0], linear[:, 0]


def _inside(line: Line) -> Array:
    """Permitted points of an even grid, and both ends of every interval of them; then NaN."""
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
    """Last permitted coordinate (R,) between a permitted one and one that is not, by bisection."""
    for _ in range(60 if inside.size else 0):
        middle = 0.5 * (inside + outside)
        there = line.within_reach(middle[:, None])[:, 0]
        inside, outside = np.where(there, middle, inside), np.where(there, outside, middle)
    return inside
