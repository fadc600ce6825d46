"""The places at which plants side by side are looked at, as `one_coordinate.grid` chooses them for one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from .single_dof import PLACES
from .vectorised import SideBySide


def grids(plants: SideBySide) -> Array:
    """Coordinates (N, K) that every muscle can take, rising; the rest of a row is not a number, all of it where a plant
    is to be asked alone."""
    low, high, straight = _ends_of_straight(plants)
    if straight[0]:
        x = np.linspace(low, high, PLACES, axis=1)
        x[~(straight & (low < high))] = np.nan
        return x
    x = _inside(plants)
    x[straight | (np.diff(x, axis=1) == 0.0).any(axis=1)] = np.nan
    return x


def _ends_of_straight(plants: SideBySide) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Both ends of the reach (N,), and whether contractions are straight lines over the coordinate."""
    c, count = plants.coordinate, len(plants.parameters)
    size, low, high = (np.array(np.broadcast_to(v, (count, 1))) for v in (c.nominal, c.lower_limit, c.upper_limit))
    straight = np.ones((count, 1), dtype=bool)
    at = [plants.contractions(k * size) for k in (0.0, 1.0, -3.0)]
    for zero, one, other, reach in zip(*at, plants.reach, strict=True):
        rate = (one - zero) / size
        straight &= np.abs(other - (zero - 3.0 * size * rate)) <= 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [(end - zero) / rate for end in reach]
        low = np.where(rate == 0.0, low, np.maximum(low, np.minimum(*ends)))
        high = np.where(rate == 0.0, high, np.minimum(high, np.maximum(*ends)))
    return low[:, 0], high[:, 0], straight[:, 0]


def _inside(plants: SideBySide) -> Array:
    """Of places spread evenly those within reach, and both ends of every stretch of them, the others at the end."""
    c, count = plants.coordinate, len(plants.parameters)
    least, greatest = (np.broadcast_to(v, (count, 1))[:, 0] for v in (c.lower_limit, c.upper_limit))
    with np.errstate(invalid="ignore"):
        x = np.linspace(least, greatest, PLACES, axis=1)
    inside = plants.within_reach(x)
    rows, i = np.nonzero(inside[:, :-1] != inside[:, 1:])
    first = inside[rows, i]
    edges = _edges(plants.of(rows), *(np.where(first, x[rows, i + k], x[rows, i + 1 - k]) for k in (0, 1)))
    columns = np.full((count, np.bincount(rows, minlength=1).max(initial=0)), np.nan)
    columns[rows, _numbered(rows)] = edges
    return np.sort(np.hstack([np.where(inside, x, np.nan), columns]), axis=1)


def _numbered(rows: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """For each of rising row numbers, how many equal ones stand before it."""
    return np.arange(rows.size) - np.searchsorted(rows, rows)


def _edges(plants: SideBySide, inside: Array, outside: Array) -> Array:
    """The last place (R,) within reach between one that is and one that is not."""
    for _ in range(60 if inside.size else 0):
        middle = 0.5 * (inside + outside)
        there = plants.within_reach(middle[:, None])[:, 0]
        inside, outside = np.where(there, middle, inside), np.where(there, outside, middle)
    return inside
