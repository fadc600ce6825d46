"""LoopSeries: path, target force and design matrix of one run of a loop; gap between its branches."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import numpy.typing as npt

from ....core.arrays import Array
from ....physics.muscle.friction import Friction
from .limits import MILLIMETRES, Axis, DataLimits

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


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSeries:
    """One run of a loop as a fit of friction uses it; N rows, C coefficients of the static curve."""

    origin: str
    path: Array
    """Displacement of the friction [m], shape (N,)."""
    time: Array | None
    """Time [s], shape (N,), if the recording has one."""
    target: Array
    """Force [N] to be explained by the static curve and the friction, shape (N,)."""
    design_matrix: Array
    """Columns of the static curve, shape (N, C)."""
    fitted_rows: npt.NDArray[np.bool_]
    """Mask of the rows whose residuals are minimised."""
    direction: Array
    """1 where the path rises, -1 where it falls."""
    limits: DataLimits
    """Maximum force and range of the speed of the fitted rows."""
    pressure: Array | None = None
    """Gauge pressure [Pa], shape (N,), of a friction that depends on the pressure; None if it is not recorded."""
    axis: Axis = MILLIMETRES
    transient_rows: int = 0
    """Number of fitted rows in which the pressure changes quickly."""

    def coefficients(self, friction: Friction | None) -> Array:
        """Least-squares coefficients of the static curve with this friction, or without friction; shape (C,)."""
        return self._coefficients(self._friction_force(friction))

    def residuals(self, friction: Friction | None, coefficients: Array) -> Array:
        """Measured - modelled force [N] at every row, shape (N,)."""
        return self._residuals(self._friction_force(friction), coefficients)

    def fitted_residuals(self, friction: Friction | None) -> Array:
        """Residuals [N] at the fitted rows, with the least-squares coefficients of the static curve."""
        force = self._friction_force(friction)
        return self._residuals(force, self._coefficients(force))[self.fitted_rows]

    def friction_force(self, friction: Friction) -> Array:
        """Friction force [N] at every row and its pressure, shape (N,)."""
        force = np.asarray(friction.force_along(self.path, self.time))
        return force if self.pressure is None else np.asarray(friction.pressure_factor(self.pressure) * force)

    def _friction_force(self, friction: Friction | None) -> Array | None:
        return None if friction is None else self.friction_force(friction)

    def _coefficients(self, friction_force: Array | None) -> Array:
        rows = self.fitted_rows
        target = self.target if friction_force is None else self.target + friction_force
        return np.asarray(self._pseudoinverse @ target[rows])

    @functools.cached_property
    def _pseudoinverse(self) -> Array:
        """Pseudoinverse of the design matrix at the fitted rows, shape (C, fitted rows)."""
        return np.asarray(np.linalg.pinv(self.design_matrix[self.fitted_rows]))

    def _residuals(self, friction_force: Array | None, coefficients: Array) -> Array:
        difference = self.target - self.design_matrix @ coefficients
        return difference if friction_force is None else difference + friction_force
