"""Whether further parameters are worth it: rows that tell something new, AICc, the F test."""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array


def effective_sample_size(errors: Array) -> float:
    """How many independent rows say as much as these N errors in the order of time: N (1 - r)/(1 + r).

    r is the correlation of neighbours, at least 0. Reference: Bayley and Hammersley (1946), "The 'effective' number
    of independent observations in an autocorrelated time series", Supplement to the Journal of the Royal Statistical
    Society 8, 184-197, for a first-order process.
    """
    centred = errors - np.mean(errors)
    power = float(centred @ centred)
    r = min(max(float(centred[1:] @ centred[:-1]) / power, 0.0), 0.999) if power > 0 else 0.0
    return errors.size * (1.0 - r) / (1.0 + r)


def aicc(mean_square: float, rows: float, parameters: int) -> float:
    """Akaike's criterion for least squares, corrected for few rows; the smaller the better.

    n ln(SSE/n) + 2k + 2k(k+1)/(n-k-1), with the variance of the errors counted among the k. Infinite where no row
    is to spare. Reference: Hurvich and Tsai (1989), Biometrika 76(2), 297-307.
    """
    k = parameters + 1
    if rows - k - 1 <= 0:
        return float("inf")
    return rows * float(np.log(max(mean_square, 1e-300))) + 2.0 * k + 2.0 * k * (k + 1) / (rows - k - 1)


def f_test_p_value(plain: float, richer: float, rows: float, parameters: int, added: int) -> float:
    """Probability that `added` idle parameters would lower the mean square error from `plain` to `richer` by chance.

    `parameters` are those of the richer model. 1 where no row is to spare.
    """
    from scipy.special import fdtrc

    spare = rows - parameters
    if spare <= 0 or added <= 0 or richer >= plain:
        return 1.0
    if richer <= 0:
        return 0.0
    return float(fdtrc(added, spare, (plain - richer) / added / (richer / spare)))
