"""Search for the maximum of an approximation error on a rectangle: grid, edge of the solutions, local refinement."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ....core.arrays import Array

_STARTS = 40
"""Points from which the search refines, chosen."""
_BISECTIONS = 12
"""Halvings of a grid step towards the edge of the solutions, chosen: 1/4096 of the step."""
_REFINEMENTS = 4
"""Local grids around each start, each three times finer than the one before, chosen: 1/81 of the step."""
_OFFSETS = np.linspace(-1.0, 1.0, 7)

_Error = Callable[[Array, Array], Array]


def estimate_maximum(error: _Error, values: Array, nodes: Array) -> float:
    """Return the maximum of `error(x, y)` on -1..1 x -1..1 from its values on a grid, refined locally.

    `values[i, j]` is the error at x = nodes[j], y = nodes[i]; NaN marks points without a solution. From the greatest
    local maxima of the grid, and from the last points with a solution between a grid point that has one and a
    neighbour that has none, local grids follow the error to its maximum. A peak narrower than the grid step, away
    from these points, is not found: the result is an estimate, from below.
    """
    step = float(nodes[1] - nodes[0])
    starts = [_local_maxima(values, nodes), *_edges(error, values, nodes)]
    x, y, best = (np.concatenate(parts) for parts in zip(*starts, strict=True))
    first = np.argsort(best)[::-1][:_STARTS]
    x, y, best = x[first], y[first], best[first]
    dx, dy = (offset.reshape(-1) for offset in np.meshgrid(_OFFSETS, _OFFSETS))
    for _ in range(_REFINEMENTS):
        near = [np.clip(at[:, None] + step * d, -1.0, 1.0) for at, d in ((x, dx), (y, dy))]
        found = np.nan_to_num(error(near[0].reshape(-1), near[1].reshape(-1)), nan=-1.0).reshape(near[0].shape)
        row, column = np.arange(len(x)), found.argmax(axis=1)
        better = found[row, column] > best
        x, y = (np.where(better, points[row, column], at) for points, at in zip(near, (x, y), strict=True))
        best = np.maximum(best, found[row, column])
        step /= 3.0
    return float(best.max())


def _local_maxima(values: Array, nodes: Array) -> tuple[Array, Array, Array]:
    """Grid points with an error not below that of their neighbours, as vectors x, y and error."""
    padded = np.pad(np.nan_to_num(values, nan=-1.0), 1, constant_values=-1.0)
    rows, columns = values.shape
    neighbours = [padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)]
    i, j = np.nonzero((values >= np.max(neighbours, axis=0)) & np.isfinite(values))
    return nodes[j], nodes[i], values[i, j]


def _edges(error: _Error, values: Array, nodes: Array) -> list[tuple[Array, Array, Array]]:
    """Last points with a solution between neighbours of the grid of which one has none, as vectors x, y and error."""
    y, x = np.meshgrid(nodes, nodes, indexing="ij")
    found = []
    for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        for inside, outside in ((one, other), (other, one)):
            at_edge = np.isfinite(values[inside]) & np.isnan(values[outside])
            if at_edge.any():
                limits = [(v[inside][at_edge], v[outside][at_edge]) for v in (x, y)]
                found.append(_bisect(error, values[inside][at_edge], *limits))
    return found


def _bisect(error: _Error, value: Array, x: tuple[Array, Array], y: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """Last points with a solution on lines from points with one to points without, and the errors there."""
    share, width = np.zeros_like(value), 1.0
    for _ in range(_BISECTIONS):
        width /= 2.0
        tried = share + width
        at = error(*((1.0 - tried) * low + tried * high for low, high in (x, y)))
        known = np.isfinite(at)
        share, value = np.where(known, tried, share), np.where(known, at, value)
    at_x, at_y = ((1.0 - share) * low + share * high for low, high in (x, y))
    return at_x, at_y, value
