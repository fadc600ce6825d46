"""Model evidence: effective sample size, AICc, F test and Student's quantile."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array

LEVEL = 0.95
"""Share of the rows that a band is stated for."""
EQUIVALENT = 2.0
"""Difference of AICc up to which laws are equivalent; the one with the fewest coefficients is then
taken (Burnham and Anderson, Model Selection and Multimodel Inference, Springer, 2002)."""


def effective_sample_size(residuals: Array) -> float:
    """Number of independent observations equivalent to N residuals in order of time: N (1 - r)/(1 +
    r).

    r is the lag-1 autocorrelation, limited to 0 to 0.999. Reference: Bayley and Hammersley (1946),
    "The 'effective' number of independent observations in an autocorrelated time series",
    Supplement to the Journal of the Royal Statistical Society 8, 184-197, for a first-order
    process.
    """
    centred = residuals - np.mean(residuals)
    power = float(centred @ centred)
    r = min(max(float(centred[1:] @ centred[:-1]) / power, 0.0), 0.999) if power > 0 else 0.0
    return residuals.size * (1.0 - r) / (1.0 + r)


def lag_one_autocorrelation(series: Sequence[Array]) -> float:
    """The lag-1 autocorrelation of residuals of zero mean in series in order of time; 0 where all
    residuals are 0.
    """
    products = sum(float(each[1:] @ each[:-1]) for each in series)
    return float(products / max(sum(float(each @ each) for each in series), 1e-300))


def aicc(mean_square: float, sample_size: float, parameters: int) -> float:
    """Akaike's information criterion for least squares with the correction for small samples; lower
    is better.

    n ln(SSE/n) + 2k + 2k(k+1)/(n-k-1), where k is the number of parameters and 1 for the residual
    variance. Infinite for n - k - 1 <= 0. Reference: Hurvich and Tsai (1989), Biometrika 76(2),
    297-307.
    """
    k = parameters + 1
    if sample_size - k - 1 <= 0:
        return float("inf")
    logarithm = float(np.log(max(mean_square, 1e-300)))
    return sample_size * logarithm + 2.0 * k + 2.0 * k * (k + 1) / (sample_size - k - 1)


def reduction_of_aicc(before: float, after: float) -> float:
    """AICc of a model minus that of a larger one; -inf where the sample is too small for the AICc
    of the larger one.
    """
    return before - after if np.isfinite(after) else -np.inf


def describe_reduction(reduction: float) -> str:
    """The difference in AICc of a larger model as a phrase."""
    known = np.isfinite(reduction)
    return (
        f"Difference in AICc {-reduction:.4g}"
        if known
        else "AICc is not defined for so few independent residuals"
    )


def f_test_p_value(
    mean_square: float, reduced: float, sample_size: float, parameters: int, added: int
) -> float:
    """p-value of the F test for `added` parameters that lower the mean square residual from
    `mean_square` to `reduced`.

    `parameters` is the number of parameters of the larger model. 1 without degrees of freedom or
    without a reduction.
    """
    from scipy.special import fdtrc

    degrees_of_freedom = sample_size - parameters
    if degrees_of_freedom <= 0 or added <= 0 or reduced >= mean_square:
        return 1.0
    if reduced <= 0:
        return 0.0
    return float(
        fdtrc(
            added,
            degrees_of_freedom,
            (mean_square - reduced) / added / (reduced / degrees_of_freedom),
        )
    )


def student_quantile(degrees_of_freedom: npt.ArrayLike, level: float) -> Array:
    """Half widths of intervals of Student's distribution at a confidence level, in standard errors;
    of the normal distribution for infinity."""
    from scipy.special import stdtrit

    return np.asarray(stdtrit(np.minimum(degrees_of_freedom, 1e9), 0.5 + level / 2))


def format_p_value(p: float) -> str:
    """A p-value as text: `p < 0.001`, or two significant digits."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"


def batch_sample_size(residuals: Array) -> float:
    """As `effective_sample_size`, by means of batches of sqrt(N) residuals, for correlations of any
    kind.

    N var(r)/(m var(mean of m residuals)), limited to N and to the number of batches. An error of a
    law is correlated over a whole ramp while the noise on it is not, so that the lag-1
    autocorrelation is too small a measure. Reference: Fishman (1978), "Grouping observations in
    digital simulation", Management Science 24, 510-521.
    """
    size = residuals.size
    length = max(int(np.sqrt(size)), 1)
    count = size // length
    centred = residuals - np.mean(residuals)
    power = float(np.mean(centred**2))
    if count < 2 or power == 0:
        return float(size)
    means = centred[: count * length].reshape(count, length).mean(axis=1)
    ratio = length * float(np.mean(means**2)) / power
    return float(np.clip(size / max(ratio, 1e-300), min(count, size), size))
