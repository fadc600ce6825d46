"""How far a fitted law may be from the truth at a point, and a reading from both."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.errors import IdentificationError
from ..recording import Recording
from .problem import RESTING_LENGTH
from .result import Fit


class Band(NamedTuple):
    """What the law gives at the points, unclamped, and the ends between which the truth lies at the level."""

    value: Array
    low: Array
    high: Array


def confidence_band(fit: Fit, points: Recording, *, level: float = 0.95, reading: bool = False) -> Band:
    """The band of a fit at points: value -+ t sqrt(g^T C g), in the quantity that the law gives.

    g is the gradient of the law by its parameters, C their covariance, t Student's quantile at N - P degrees of
    freedom. With `reading` the noise of one more reading is added to the law's own uncertainty. `points` carry the
    columns that the law asks for, and a resting length where it was fitted to several. A parameter on a bound is
    taken as known. The errors must be independent: readings of one slow ramp are not, and `bootstrap` by runs tells
    how much that is. Raises IdentificationError where no point was to spare.
    """
    from scipy.special import stdtrit

    spare = int(np.count_nonzero(fit.censoring == 0)) - len(fit.estimates)
    if spare <= 0 or not np.isfinite(fit.sigma):
        raise IdentificationError(f"{fit.recording.origin}: as many points as parameters, so no band can be told.")
    if not 0 < level < 1:
        raise IdentificationError(f"the level of a band is {level:g}; it must lie between 0 and 1, as 0.95 does.")
    columns = {name: points[name] for name in fit.fitted_quantity.arguments}
    rest = points.constants.get(RESTING_LENGTH)
    if rest is not None:
        columns[RESTING_LENGTH] = np.full(len(points), float(rest))
    problem = dataclasses.replace(fit.problem, data=Recording(columns, points.origin))
    value, slopes = problem.predict(fit.values), problem.jacobian(fit.values)
    covariance = np.nan_to_num(fit.covariance, nan=0.0)
    variance = np.einsum("ni,ij,nj->n", slopes, covariance, slopes)
    half = float(stdtrit(spare, 0.5 + level / 2)) * np.sqrt(np.maximum(variance, 0.0) + reading * fit.sigma**2)
    return Band(value, value - half, value + half)
