"""Gap between the branches of a loop, and difference of two runs; `bench.segment` separates the branches."""

from __future__ import annotations

import dataclasses

import numpy as np

from ....core.arrays import Array

BIN_COUNT = 24
"""Bins along the path in which branches are compared (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class BinnedDifference:
    """Differences of two branches in bins, shape (bins,), and their weights, inverse to the variance of the means."""

    values: Array
    weights: Array

    @property
    def rms(self) -> float:
        """Weighted root mean square of the differences; NaN without a common bin."""
        return float(np.sqrt(np.average(self.values**2, weights=self.weights))) if self.values.size else float("nan")


EMPTY = BinnedDifference(np.empty(0), np.empty(0))


def binned_difference(path: Array, values: Array, other_path: Array, other_values: Array) -> BinnedDifference:
    """Second branch minus first branch in the bins of the common path where both have rows.

    A bin with n rows of one branch and m of the other has the weight n m/(n + m).

    The values should be residuals from a common static curve, not forces: within a bin the slope of a steep curve would
    appear as a difference.
    """
    if not path.size or not other_path.size:
        return EMPTY
    low, high = max(path.min(), other_path.min()), min(path.max(), other_path.max())
    edges = np.linspace(low, high, BIN_COUNT + 1)
    if not low < high:
        return EMPTY
    (first, n), (second, m) = _bin_means(path, values, edges), _bin_means(other_path, other_values, edges)
    common = (n > 0) & (m > 0)
    return BinnedDifference((second - first)[common], (n * m)[common] / (n + m)[common])


def _bin_means(path: Array, values: Array, edges: Array) -> tuple[Array, Array]:
    """Mean of the values in every bin, NaN in an empty bin; and the numbers of rows."""
    bins = np.digitize(path, edges[1:-1])
    inside = (path >= edges[0]) & (path <= edges[-1])
    counts = np.bincount(bins[inside], minlength=edges.size - 1)
    sums = np.bincount(bins[inside], values[inside], minlength=edges.size - 1)
    means = np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0)
    return means, np.asarray(counts, dtype=float)


def branch_gap(path: Array, values: Array, direction: Array) -> BinnedDifference:
    """Falling minus rising branch in bins along the path; `direction` is 1 where the path rises, -1 where it falls."""
    rising, falling = direction > 0, direction < 0
    return binned_difference(path[rising], values[rising], path[falling], values[falling])


def repeat_difference(
    path: Array, values: Array, direction: Array, other_path: Array, other_values: Array, other_direction: Array
) -> BinnedDifference:
    """Second run minus first run of the same loop, branch by branch, in bins along the path."""
    pairs = ((direction > 0, other_direction > 0), (direction < 0, other_direction < 0))
    both = [binned_difference(path[a], values[a], other_path[b], other_values[b]) for a, b in pairs]
    return BinnedDifference(np.concatenate([d.values for d in both]), np.concatenate([d.weights for d in both]))
