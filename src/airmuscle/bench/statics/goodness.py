"""Goodness of a static fit: errors of its rows, and whether the levels of the data determine it."""

import dataclasses
from typing import Any

import numpy as np

from ...core import Array
from ...recording import Recording
from ..estimation import LeastSquaresSolution, check_determined, correlation_index
from ..inspection import POINT_COLUMNS, rounding
from .fit_problem import FitProblem


@dataclasses.dataclass(frozen=True)
class WorstPoint:
    """The residual (model - measured) of maximum magnitude and the point where it occurs, all
    SI.
    """

    error: float
    pressure: float
    contraction: float
    force: float


def goodness_of_fit(problem: FitProblem, modelled: Array, data: Recording) -> dict[str, Any]:
    """The rms error, maximum error and correlation index of a law, as fields of a `Fit`. The error
    at a row is model - measured, with the model (N,) clamped; at a censored row it is the violation
    of its bound, because its reading is not a measured value. The squares of violations are added
    to those of measured rows."""
    measured = problem.censoring == 0
    target = data[problem.fitted_quantity.name]
    errors = problem.residuals(modelled) / problem.weights
    worst = int(np.argmax(np.abs(errors)))
    varies = float(np.ptp(target[measured])) > rounding("", target[measured])
    return {
        "rmse": float(np.sqrt(errors @ errors / max(int(np.count_nonzero(measured)), 1))),
        "max_error": WorstPoint(
            float(errors[worst]), *(float(data[name][worst]) for name in POINT_COLUMNS)
        ),
        "correlation_index": (
            correlation_index(target[measured], modelled[measured]) if varies else None
        ),
    }


def check_determined_by_levels(
    problem: FitProblem, solution: LeastSquaresSolution, at_levels: Recording
) -> None:
    """Raise IdentificationError where only the noise or ripple of a constant quantity determines
    the parameters. `at_levels` are the data of the problem with the constant quantity of each run
    at its level."""
    data = problem.data
    arguments = problem.fitted_quantity.arguments
    if at_levels is data or all(np.array_equal(at_levels[name], data[name]) for name in arguments):
        return
    levelled = dataclasses.replace(problem, data=at_levels)
    check_determined(levelled, solution._replace(jacobian=levelled.jacobian(solution.values)))
