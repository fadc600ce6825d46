"""The branches of a loop, found from its path, and what lies between them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..loss import Array

PLACES = 24
"""Places along the path at which branches are compared (chosen)."""


def rising(path: Array) -> npt.NDArray[np.bool_]:
    """The rows up to the greatest value of a path of one loop: the inflating branch of a ramp of pressure."""
    return np.arange(path.size) <= int(np.argmax(path))


def between(path: Array, values: Array, other_path: Array, other_values: Array) -> Array:
    """Differences of two branches, the second less the first, at places of the path where both have rows.

    Give errors from one common static curve, not forces: within a place a steep curve would look like a difference.
    """
    low, high = max(path.min(), other_path.min()), min(path.max(), other_path.max())
    edges = np.linspace(low, high, PLACES + 1)
    means = _means(path, values, edges), _means(other_path, other_values, edges)
    found: Array = means[1] - means[0]
    return np.asarray(found[np.isfinite(found)])


def _means(path: Array, values: Array, edges: Array) -> Array:
    place = np.digitize(path, edges[1:-1])
    inside = (path >= edges[0]) & (path <= edges[-1])
    counts = np.bincount(place[inside], minlength=edges.size - 1)
    sums = np.bincount(place[inside], values[inside], minlength=edges.size - 1)
    means: Array = np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0)
    return means


def gap(path: Array, values: Array) -> Array:
    """Falling less rising branch of one loop, at places along its path."""
    up = rising(path)
    return between(path[up], values[up], path[~up], values[~up])


def repeat_difference(path: Array, values: Array, other_path: Array, other_values: Array) -> Array:
    """What a second run of the same loop gives beyond the first, branch by branch, at places along the path."""
    up, other_up = rising(path), rising(other_path)
    pairs = ((up, other_up), (~up, ~other_up))
    return np.concatenate([between(path[a], values[a], other_path[b], other_values[b]) for a, b in pairs])
