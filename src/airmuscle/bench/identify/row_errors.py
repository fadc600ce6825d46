"""Errors of a fit by row: measured rows, and censored rows, which count with the violation of their bound."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...recording import Recording
from .problem import FitProblem


@dataclasses.dataclass(frozen=True)
class WorstPoint:
    """The residual (model - measured) of maximum magnitude and the point where it occurs, all SI."""

    error: float
    pressure: float
    contraction: float
    force: float

    @classmethod
    def of(cls, errors: Array, data: Recording) -> WorstPoint:
        """The row of the error (N,) of maximum magnitude."""
        worst = int(np.argmax(np.abs(errors)))
        return cls(float(errors[worst]), *(float(data[name][worst]) for name in ("pressure", "contraction", "force")))


def row_errors(problem: FitProblem, modelled: Array) -> Array:
    """Model - measured at every row (N,); at a censored row the violation of its bound, because its reading is not a
    measured value."""
    return problem.residuals(modelled) / problem.weights


def rms_of_rows(errors: Array, measured: npt.NDArray[np.bool_]) -> float:
    """Root mean square of the errors (N,) in relation to the measured rows (mask); squares of violations are added."""
    return float(np.sqrt(errors @ errors / max(int(np.count_nonzero(measured)), 1)))
