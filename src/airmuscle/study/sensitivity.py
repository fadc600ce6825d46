"""Variance-based sensitivities: which part of an outcome's variance comes from which input.

First order   S_i = V(E(f | x_i)) / V(f)        the part that knowing x_i would remove
total         T_i = 1 - V(E(f | x_others)) / V(f)   the part that would be left if only x_i were unknown

estimated from the runs A, B and A with column i from B (the design Saltelli), f less its mean:
    S_i = mean(f_B (f_ABi - f_A)) / V,   T_i = mean((f_A - f_ABi)^2) / (2 V),   V = variance of f_A and f_B together.
The T_i are never negative and sum to 1 or more; the S_i sum to 1 or less; T_i - S_i is what x_i does together with
others. Small S_i may come out below 0.

References: Sobol, Math. and Computers in Simulation 55 (2001) 271-280; Jansen, Computer Physics Communications 117
(1999) 35-43 (T_i); Saltelli et al., Computer Physics Communications 181 (2010) 259-270 (S_i, and the design).
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..core.arrays import Array

CONFIDENCE = 0.95
BOOTSTRAP_SAMPLES = 1000
SAMPLES_PER_BATCH = 20


@dataclasses.dataclass(frozen=True, eq=False)
class SobolIndices:
    """Sobol indices of one outcome: first order and total (d,), each with its bootstrap interval (2, d).

    `points` base points were used, `left_out` were not because one of their runs failed or has no such outcome.
    All are NaN where the outcome does not vary.
    """

    first: Array
    total: Array
    first_interval: Array
    total_interval: Array
    base_points: int
    excluded_points: int


def sobol_indices(outcome: Array, variables: int, seed: int = 0) -> SobolIndices:
    """The indices of an outcome (n (d + 2),), run by run as the design Saltelli orders them.

    The intervals are percentiles of 1000 bootstrap samples of the base points, drawn from `seed`.
    """
    table = outcome.reshape(-1, variables + 2)
    complete = np.isfinite(table).all(axis=1)
    sums = _summands(table[complete])
    count = len(sums)
    nothing = np.full(variables, np.nan)
    if not _varies(table[complete]):
        return SobolIndices(
            nothing, nothing, np.tile(nothing, (2, 1)), np.tile(nothing, (2, 1)), count, len(table) - count
        )
    first, total = _indices(sums.mean(axis=0)[None, :], variables)
    generator = np.random.default_rng(seed)
    drawn = []
    for _ in range(BOOTSTRAP_SAMPLES // SAMPLES_PER_BATCH):  # a table of all samples at once would not fit the memory
        weights = generator.multinomial(count, np.full(count, 1.0 / count), size=SAMPLES_PER_BATCH)
        drawn.append(_indices(weights @ sums / count, variables))
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    intervals = [np.nanquantile(np.concatenate([pair[i] for pair in drawn]), tails, axis=0) for i in (0, 1)]
    return SobolIndices(first[0], total[0], intervals[0], intervals[1], count, len(table) - count)


def _summands(table: Array) -> Array:
    """What the estimators average, by base point (n, 2 d + 2); a bootstrap sample then is a matrix product."""
    table = table - table[:, [0, -1]].mean() if len(table) else table
    a, mixed, b = table[:, :1], table[:, 1:-1], table[:, -1:]
    return np.hstack([b * (mixed - a), 0.5 * (a - mixed) ** 2, 0.5 * (a + b), 0.5 * (a * a + b * b)])


def _varies(table: Array) -> bool:
    """Whether the outcome differs between base points by more than rounding."""
    return bool(len(table) and np.ptp(table) > 1e-12 * np.abs(table).max() and np.ptp(table[:, [0, -1]]) > 0)


def _indices(means: Array, variables: int) -> tuple[Array, Array]:
    """First order and total (R, d) from the averages (R, 2 d + 2); NaN for a sample that repeats one point."""
    variance = means[:, -1:] - means[:, -2:-1] ** 2
    variance = np.where(variance > 0, variance, np.nan)
    return means[:, :variables] / variance, means[:, variables : 2 * variables] / variance
