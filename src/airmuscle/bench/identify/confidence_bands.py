"""Confidence and prediction bands of a fitted law."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from ...core.arrays import Array
from ...core.errors import IdentificationError
from ...recording import Recording
from .model_evidence import student_quantile
from .pooling import pooled_band
from .problem import RESTING_LENGTH
from .result import Fit


class Band(NamedTuple):
    """The fitted quantity at the points, not clamped, with the lower and upper limit of its band; shape (N,) each."""

    value: Array
    low: Array
    high: Array


def confidence_band(fit: Fit, points: Recording, *, level: float = 0.95, prediction: bool = False) -> Band:
    """The confidence band of a fit at points: value -+ t sqrt(g^T C g), in the fitted quantity [SI].

    g is the gradient of the law with respect to its parameters, C their covariance, t the quantile of Student's
    distribution. Covariance and degrees of freedom follow from the scatter of the runs, or of parts of them, where rows
    are correlated (`fit.error_basis` states which); for independent rows the latter are N - P. `prediction` gives the
    prediction band of one further observation of the measured runs: the residual variance is added.
    `points` has the columns that the law takes as arguments, and the constant `resting_length` if the law was fitted to
    several lengths.

    The band of a PooledLengthLaw is that of the specimen that `points` state (the constant `specimen`, or else the
    resting length), or of a new muscle, with the scatter of the specimens and that of the runs.
    Raises IdentificationError without degrees of freedom, or for a level outside 0 to 1.
    """
    degrees_of_freedom = fit.degrees_of_freedom
    if degrees_of_freedom <= 0 or not np.isfinite(fit.sigma):
        raise IdentificationError(
            f"{fit.recording.origin}: the band cannot be computed, because there are no more uncensored rows than "
            "parameters. Measure more points."
        )
    if not 0 < level < 1:
        raise IdentificationError(f"the confidence level is {level:g}; it must lie between 0 and 1, e.g. 0.95.")
    columns = {name: points[name] for name in fit.fitted_quantity.arguments}
    length = points.constants.get(RESTING_LENGTH)
    if length is not None:
        columns[RESTING_LENGTH] = np.full(len(points), float(length))
    problem = dataclasses.replace(fit.problem, data=Recording(columns, points.origin))
    value, jacobian = problem.predict(fit.values), problem.jacobian(fit.values)
    quantile = float(student_quantile(degrees_of_freedom, level))
    if fit.effects is None:
        half = fit.parameter_covariance.half_widths(jacobian, level)
    else:
        offset, half = pooled_band(fit, points, jacobian, level)
        value = value + offset
    half = np.hypot(half, prediction * quantile * fit.sigma)
    return Band(value, value - half, value + half)
