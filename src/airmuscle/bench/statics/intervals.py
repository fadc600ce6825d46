"""Intervals of a static fit: confidence and prediction bands of the law, profile likelihood of a
parameter.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from ...core import Array, IdentificationError
from ...recording import Recording
from .. import statics
from ..estimation import LeastSquares, profile_limits, student_quantile
from .fit_problem import RESTING_LENGTH
from .static_fit_result import Fit


class Band(NamedTuple):
    """The fitted quantity at the points, not clamped, with the lower and upper limit of its band;
    shape (N,) each.
    """

    value: Array
    low: Array
    high: Array


def confidence_band(
    fit: Fit, points: Recording, *, level: float = 0.95, prediction: bool = False
) -> Band:
    """The confidence band of a fit at points: value -+ t sqrt(g^T C g), in the fitted quantity
    [SI].

    g is the gradient of the law with respect to its parameters, C their covariance, t the quantile
    of Student's distribution. The band is that of the mean law of this muscle: of the fits of
    further repeats of the same runs. What the law does not follow is equal in all of these, and is
    not contained (`form_terms`). Covariance and degrees of freedom follow from the scatter of the
    runs, or within them, where rows are correlated (`fit.error_basis` states which); for
    independent rows the latter are N - P. `prediction` gives the band of one observation of a
    further run of this muscle: the residual variance, with the form error, is added. `points` has
    the columns that the law takes as arguments, and the constant `resting_length` if the law was
    fitted to several lengths.

    The band of a PooledLengthLaw is that of the specimen that `points` state (the constant
    `specimen`, or else the resting length), or of a new muscle, with the scatter of the specimens
    and that of the runs. Raises IdentificationError without degrees of freedom, or for a level
    outside 0 to 1.
    """
    degrees_of_freedom = fit.degrees_of_freedom
    if degrees_of_freedom <= 0 or not np.isfinite(fit.sigma):
        raise IdentificationError(
            f"{fit.recording.origin}: the band cannot be computed, because there are no more"
            " uncensored rows than parameters. Measure more points."
        )
    if not 0 < level < 1:
        raise IdentificationError(
            f"the confidence level is {level:g}; it must lie between 0 and 1, e.g. 0.95."
        )
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
        offset, half = statics.pooled_band(fit, points, jacobian, level)
        value = value + offset
    half = np.hypot(half, prediction * quantile * fit.sigma)
    return Band(value, value - half, value + half)


_HIGH_CORRELATION = 0.99
_HIGH_RELATIVE_ERROR = 0.5
"""Absolute correlation, or relative standard error, above which a standard error is not trusted
(chosen).
"""


@dataclasses.dataclass(frozen=True)
class ProfileLikelihood:
    """Confidence interval of a parameter; a limit that the data do not determine is infinite."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    level: float

    def __str__(self) -> str:
        ends = [f"{end:.4g}" if np.isfinite(end) else "unbounded" for end in (self.low, self.high)]
        unit = "" if self.unit == "1" else f" {self.unit}"
        interval = f"{100 * self.level:.0f} % confidence interval {ends[0]} to {ends[1]}"
        return f"{self.name} {self.value:.4g}{unit}, {interval}"


def weakly_determined(fit: Fit) -> tuple[str, ...]:
    """Names of the parameters whose standard error is not reliable. These are highly correlated
    with another parameter or, in a nonlinear fit, have a large relative standard error."""
    correlation = fit.parameter_covariance.greatest_correlations()
    # In a linear fit a standard error is exact, however large.
    nonlinear = not fit.problem.is_linear
    return tuple(
        e.name
        for e, r in zip(fit.estimates, correlation, strict=True)
        if not e.on_bound
        and (
            r > _HIGH_CORRELATION or (nonlinear and e.stderr > _HIGH_RELATIVE_ERROR * abs(e.value))
        )
    )


def profile(fit: Fit, name: str, *, level: float = 0.95) -> ProfileLikelihood:
    """The profile-likelihood interval of one parameter (Bates and Watts (1988), Nonlinear
    Regression, 6.1).

    It holds all values for which the sum of squares, minimised over the other parameters, stays
    below S (1 + F/(N - P)), where F is the quantile of Fisher's distribution with 1 and N - P
    degrees of freedom; P counts the parameters that are not on a bound. Where rows are correlated,
    F is multiplied by the squared ratio of the half width of the interval by standard errors
    (`fit.error_basis`) to that for independent rows. Raises IdentificationError for a robust fit, a
    parameter on its bound, or without degrees of freedom.
    """
    if not isinstance(fit.loss, LeastSquares):
        raise IdentificationError(
            "a likelihood profile needs a fit by least squares, because a robust loss is no"
            " likelihood of the noise. Fit with LeastSquares()."
        )
    estimate = fit[name]
    degrees_of_freedom = fit.degrees_of_freedom
    if degrees_of_freedom <= 0 or not np.isfinite(estimate.stderr):
        raise IdentificationError(
            f"{name} has no likelihood profile, because it is on its bound or there are no more"
            " uncensored rows than parameters."
        )
    index = fit.names.index(name)
    ratio = fit.parameter_covariance.error_ratio(index, level)
    low, high = profile_limits(
        fit.problem, fit.values, index, estimate.stderr, ratio**2 / degrees_of_freedom
    )
    return ProfileLikelihood(name, estimate.unit, estimate.value, low, high, level)
