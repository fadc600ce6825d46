"""Gap between the branches of a loop, and difference of two runs; `recording.segment` separates the branches."""

from __future__ import annotations

import numpy as np

from ...core.arrays import Array

BIN_COUNT = 24
"""Bins along the path in which branches are compared (chosen)."""


def binned_difference(path: Array, values: Array, other_path: Array, other_values: Array) -> Array:
    """Second branch minus first branch in the bins of the common path where both have rows, shape (bins,).

    The values should be residuals from a common static curve, not forces: within a bin the slope of a steep curve would
    appear as a difference.
    """
    if not path.size or not other_path.size:
        return np.empty(0)
    low, high = max(path.min(), other_path.min()), min(path.max(), other_path.max())
    edges = np.linspace(low, high, BIN_COUNT + 1)
    means = _bin_means(path, values, edges), _bin_means(other_path, other_values, edges)
    difference: Array = means[1] - means[0]
    return np.asarray(difference[np.isfinite(difference)])


def _bin_means(path: Array, values: Array, edges: Array) -> Array:
    """Mean of the values in every bin; NaN in an empty bin."""
    bins = np.digitize(path, edges[1:-1])
    inside = (path >= edges[0]) & (path <= edges[-1])
    counts = np.bincount(bins[inside], minlength=edges.size - 1)
    sums = np.bincount(bins[inside], values[inside], minlength=edges.size - 1)
    means: Array = np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0)
    return means


def branch_gap(path: Array, values: Array, direction: Array) -> Array:
    """Falling minus rising branch in bins along the path; `direction` is 1 where the path rises, -1 where it falls."""
    rising, falling = direction > 0, direction < 0
    return binned_difference(path[rising], values[rising], path[falling], values[falling])


def repeat_difference(
    path: Array, values: Array, direction: Array, other_path: Array, other_values: Array, other_direction: Array
) -> Array:
    """Second run minus first run of the same loop, branch by branch, in bins along the path."""
    pairs = ((direction > 0, other_direction > 0), (direction < 0, other_direction < 0))
    return np.concatenate([binned_difference(path[a], values[a], other_path[b], other_values[b]) for a, b in pairs])
