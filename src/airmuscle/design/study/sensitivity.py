"""Variance-based sensitivities: Sobol indices with bootstrap confidence intervals.

First order   S_i = V(E(f | x_i)) / V(f)              fraction of the variance removed if x_i were known
total         T_i = 1 - V(E(f | x_others)) / V(f)     fraction that remains if only x_i were unknown

estimated from the runs A, B and A with column i from B (the design Saltelli), with f centred about its mean:
    S_i = mean(f_B (f_ABi - f_A)) / V,   T_i = mean((f_A - f_ABi)^2) / (2 V),   V = variance of f_A and f_B together.
The T_i are not negative, and their sum is at least 1; the sum of the S_i is at most 1; T_i - S_i is the contribution of
the interactions of x_i with other parameters. Estimates of small S_i may be negative.

References: Sobol, Math. and Computers in Simulation 55 (2001) 271-280; Jansen, Computer Physics Communications 117
(1999) 35-43 (T_i); Saltelli et al., Computer Physics Communications 181 (2010) 259-270 (S_i, and the design).
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ...core.arrays import Array

CONFIDENCE = 0.95
BOOTSTRAP_SAMPLES = 1000
SAMPLES_PER_BATCH = 20


@dataclasses.dataclass(frozen=True, eq=False)
class SobolIndices:
    """Sobol indices of one metric: first order and total (d,), each with its bootstrap interval (2, d).

    `base_points` is the number of base points used, `excluded_points` the number of those excluded because the metric
    is missing for one of their runs. All indices are NaN if the metric does not vary.
    """

    first: Array
    total: Array
    first_interval: Array
    total_interval: Array
    base_points: int
    excluded_points: int


def sobol_indices(metric: Array, parameters: int, seed: int = 0) -> SobolIndices:
    """The indices of a metric (n (d + 2),) with respect to d parameters, from runs in the order of the design Saltelli.

    The intervals are percentiles (95 %) of 1000 bootstrap samples of the base points, drawn with `seed`.
    """
    table = metric.reshape(-1, parameters + 2)
    complete = np.isfinite(table).all(axis=1)
    terms = _summands(table[complete])
    count = len(terms)
    undefined = np.full(parameters, np.nan)
    if not _varies(table[complete]):
        no_interval = np.tile(undefined, (2, 1))
        return SobolIndices(undefined, undefined, no_interval, no_interval, count, len(table) - count)
    first, total = _indices(terms.mean(axis=0)[None, :], parameters)
    generator = np.random.default_rng(seed)
    samples = []
    for _ in range(BOOTSTRAP_SAMPLES // SAMPLES_PER_BATCH):  # in batches, to bound the memory
        weights = generator.multinomial(count, np.full(count, 1.0 / count), size=SAMPLES_PER_BATCH)
        samples.append(_indices(weights @ terms / count, parameters))
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    intervals = [np.nanquantile(np.concatenate([pair[i] for pair in samples]), tails, axis=0) for i in (0, 1)]
    return SobolIndices(first[0], total[0], intervals[0], intervals[1], count, len(table) - count)


def _summands(table: Array) -> Array:
    """The terms that the estimators average, per base point (n, 2 d + 2); a bootstrap sample is a matrix product."""
    table = table - table[:, [0, -1]].mean() if len(table) else table
    a, mixed, b = table[:, :1], table[:, 1:-1], table[:, -1:]
    return np.hstack([b * (mixed - a), 0.5 * (a - mixed) ** 2, 0.5 * (a + b), 0.5 * (a * a + b * b)])


def _varies(table: Array) -> bool:
    """Whether the metric varies by more than rounding errors."""
    return bool(len(table) and np.ptp(table) > 1e-12 * np.abs(table).max() and np.ptp(table[:, [0, -1]]) > 0)


def _indices(means: Array, parameters: int) -> tuple[Array, Array]:
    """First order and total (R, d) from the means (R, 2 d + 2); NaN for a sample of a single repeated point."""
    variance = means[:, -1:] - means[:, -2:-1] ** 2
    variance = np.where(variance > 0, variance, np.nan)
    return means[:, :parameters] / variance, means[:, parameters : 2 * parameters] / variance
