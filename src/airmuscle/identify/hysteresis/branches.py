"""What lies between the branches of a loop, and between two runs of it; `recording.segment` finds the branches."""

from __future__ import annotations

import numpy as np

from ...core.arrays import Array

BIN_COUNT = 24
"""Places along the path at which branches are compared (chosen)."""


def binned_difference(path: Array, values: Array, other_path: Array, other_values: Array) -> Array:
    """Differences of two branches, the second less the first, at places of the path where both have rows.

    Give errors from one common static curve, not forces: within a place a steep curve would look like a difference.
    """
    if not path.size or not other_path.size:
        return np.empty(0)
    low, high = max(path.min(), other_path.min()), min(path.max(), other_path.max())
    edges = np.linspace(low, high, BIN_COUNT + 1)
    means = _bin_means(path, values, edges), _bin_means(other_path, other_values, edges)
    found: Array = means[1] - means[0]
    return np.asarray(found[np.isfinite(found)])


def _bin_means(path: Array, values: Array, edges: Array) -> Array:
    place = np.digitize(path, edges[1:-1])
    inside = (path >= edges[0]) & (path <= edges[-1])
    counts = np.bincount(place[inside], minlength=edges.size - 1)
    sums = np.bincount(place[inside], values[inside], minlength=edges.size - 1)
    means: Array = np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0)
    return means


def branch_gap(path: Array, values: Array, way: Array) -> Array:
    """Falling less rising branches, at places along the path; `way` is 1 where a row rises, -1 where it falls."""
    up, down = way > 0, way < 0
    return binned_difference(path[up], values[up], path[down], values[down])


def repeat_difference(
    path: Array, values: Array, way: Array, other_path: Array, other_values: Array, other_way: Array
) -> Array:
    """What a second run of the same loop gives beyond the first, branch by branch, at places along the path."""
    pairs = ((way > 0, other_way > 0), (way < 0, other_way < 0))
    return np.concatenate([binned_difference(path[a], values[a], other_path[b], other_values[b]) for a, b in pairs])
