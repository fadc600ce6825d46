"""Values of state estimators: estimates, innovations, measured rows, and the arrays of a compiled filter."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array


class StateEstimate(NamedTuple):
    """Mean (n,) and covariance (n, n) of the estimated states of a plant."""

    mean: Array
    covariance: Array


class Innovation(NamedTuple):
    """Measured minus predicted columns (p,) and their covariance (p, p)."""

    difference: Array
    covariance: Array

    @property
    def normalised_square(self) -> float:
        """nu^T S^-1 nu [1]; its mean is p for a consistent filter."""
        return float(self.difference @ np.linalg.solve(self.covariance, self.difference))


class BoundFilter(NamedTuple):
    """The compiled prediction and correction of a filter with the arrays that they read and write."""

    mean: Array
    covariance: Array
    inputs: Array
    values: Array
    difference: Array
    difference_covariance: Array
    transition: Array
    variances: Array
    slopes: Array
    predict: Any = None
    correct: Any = None


class MeasuredRows(NamedTuple):
    """Times (N,) [s], measured columns (N, p), inputs held before each row (N, m), samples between rows (N - 1,)."""

    time: Array
    measured: Array
    held: Array
    counts: npt.NDArray[np.int64]


class Pass(NamedTuple):
    """A sample of a filter: its row, None where it was lost, the estimate before and after its correction, inputs."""

    row: int | None
    predicted: StateEstimate
    corrected: StateEstimate
    inputs: Array
