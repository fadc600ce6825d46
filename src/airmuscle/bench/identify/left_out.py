"""Band for a member of a family that was not measured, from the errors of the members that were left out in turn.

The members are specimens of a type, or records of a plant. The error of a further member at a row is taken as normal
with a variance that is common to all members, and known only from the n members that were left out; errors of one
member have one sign over many rows, so that the rows do not count. The band is therefore that of Student's t
distribution with n - 1 degrees of freedom.

A law of muscles of several lengths is a regression of the specimens by ln L_0. A specimen that is left out at the end
of the range is predicted by extrapolation, and has an error that is greater than that of a further one within the
range: the variance of the former is s^2/(1 - h_i), that of the latter s^2 (1 + h), with the leverages h of the
regression (Cook and Weisberg, Residuals and Influence in Regression (1982), section 2.2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...core.arrays import Array
from .model_evidence import student_quantile

LEVEL = 0.95
"""Share of the rows that a band is stated for."""
MIN_MEMBERS = 3
"""Minimum number of specimens from which a band for others is stated (chosen): of two, each predicts the other."""


def root_mean_square(errors: Sequence[float]) -> float:
    """The root mean square of the rms errors of the members, each counted once."""
    return math.sqrt(sum(error**2 for error in errors) / len(errors))


def t_quantile(degrees_of_freedom: float) -> float:
    """The quantile of Student's t distribution that bounds 95 % on both sides; that of the normal one for infinity."""
    return float(student_quantile(degrees_of_freedom, LEVEL))


def degrees_of_freedom(left_out: float, within: float, members: int) -> float:
    """Effective degrees of freedom of the variance of a further member (Satterthwaite, Biometrics 2:110 (1946)).

    left_out  rms error of the members that were left out
    within    rms noise of the rows, whose variance comes from many rows and counts as known
    members   number of members

    The excess of the squared error, which is the variance between the members, has `members` - 1 degrees of freedom.
    Infinite where there is none.
    """
    between = left_out**2 - within**2
    return math.inf if between <= 0.0 else (members - 1) * (left_out**2 / between) ** 2


def leverages(lengths: Sequence[float], at: Sequence[float]) -> Array:
    """The leverages of resting lengths `at` [m] in a regression of a quantity by ln L_0 over `lengths` [m], one for
    each specimen; shape of `at`. Of lengths that are all equal, those of a mean."""
    x, x0 = np.log(np.asarray(lengths)), np.log(np.asarray(at))
    square = float(np.sum((x - x.mean()) ** 2))
    slope = (x0 - x.mean()) ** 2 / square if square > 1e-12 else np.zeros(x0.shape)
    return np.asarray(1.0 / x.size + slope)


def widening(lengths: Sequence[float], length: float) -> float:
    """The ratio of the half width at a resting length [m] to that at the geometric mean of the measured ones [m]."""
    (leverage,) = leverages(lengths, [length])
    return math.sqrt((1.0 + float(leverage)) / (1.0 + 1.0 / len(lengths)))


def specimen_deviation(rms: Sequence[float], lengths: Sequence[float]) -> float:
    """The standard deviation of the error of a specimen about the regression, from the rms errors of those left out.

    lengths  resting lengths [m] of the specimens, by which the law depends on them; empty if it does not
    """
    places = lengths or [1.0] * len(rms)
    remaining = np.maximum(1.0 - leverages(places, places), 0.0)
    return float(np.sqrt(np.mean(remaining * np.square(rms))))
