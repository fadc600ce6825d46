"""Variance-based sensitivity indices (Sobol indices) of a study, as table and as bars.

First order   S_i = V(E(f | x_i)) / V(f)              fraction of the variance removed if x_i were
              known
total         T_i = 1 - V(E(f | x_others)) / V(f)     fraction that remains if only x_i were unknown

estimated from the runs A, B and A with column i from B (the design Saltelli), with f centred about
its mean:
    S_i = mean(f_B (f_ABi - f_A)) / V,   T_i = mean((f_A - f_ABi)^2) / (2 V),   V = variance of f_A
                                         and f_B together.
The T_i are not negative, and their sum is at least 1; the sum of the S_i is at most 1; T_i - S_i is
the contribution of the interactions of x_i with other parameters. Estimates of small S_i may be
negative.

References: Sobol, Math. and Computers in Simulation 55 (2001) 271-280; Jansen, Computer Physics
Communications 117 (1999) 35-43 (T_i); Saltelli et al., Computer Physics Communications 181 (2010)
259-270 (S_i, and the design).
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, ORANGE, Array, legend_below, new_figure
from ...report.chapter import Table, TableColumn

CONFIDENCE = 0.95
BOOTSTRAP_SAMPLES = 1000
SAMPLES_PER_BATCH = 20
MAX_SENSITIVITIES = 12
"""Rows of the brief view (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class SobolIndices:
    """Sobol indices of one metric: first order and total (d,), each with its bootstrap interval (2,
    d).

    `base_points` is the number of base points used, `excluded_points` the number of those excluded
    because the metric is missing for one of their runs. All indices are NaN if the metric does not
    vary.
    """

    first: Array
    total: Array
    first_interval: Array
    total_interval: Array
    base_points: int
    excluded_points: int


def sobol_indices(metric: Array, parameters: int, seed: int = 0) -> SobolIndices:
    """The indices of a metric (n (d + 2),) with respect to d parameters, from runs in the order of
    the design Saltelli.

    The intervals are percentiles (95 %) of 1000 bootstrap samples of the base points, drawn with
    `seed`.
    """
    table = metric.reshape(-1, parameters + 2)
    known = table[np.isfinite(table).all(axis=1)]
    count = len(known)
    undefined = np.full(parameters, np.nan)
    varies = (
        len(known) and np.ptp(known) > 1e-12 * np.abs(known).max() and np.ptp(known[:, [0, -1]]) > 0
    )
    if not varies:  # by more than rounding errors
        no_interval = np.tile(undefined, (2, 1))
        return SobolIndices(
            undefined, undefined, no_interval, no_interval, count, len(table) - count
        )
    centred = known - known[:, [0, -1]].mean()
    a = centred[:, :1]
    mixed = centred[:, 1:-1]
    b = centred[:, -1:]
    # what the estimators average, per base point (n, 2 d + 2); a bootstrap sample is a matrix
    # product
    terms = np.hstack(
        [b * (mixed - a), 0.5 * (a - mixed) ** 2, 0.5 * (a + b), 0.5 * (a * a + b * b)]
    )
    first, total = _indices(terms.mean(axis=0)[None, :], parameters)
    generator = np.random.default_rng(seed)
    samples = []
    for _ in range(BOOTSTRAP_SAMPLES // SAMPLES_PER_BATCH):  # in batches, to bound the memory
        weights = generator.multinomial(count, np.full(count, 1.0 / count), size=SAMPLES_PER_BATCH)
        samples.append(_indices(weights @ terms / count, parameters))
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    intervals = [
        np.nanquantile(np.concatenate([pair[i] for pair in samples]), tails, axis=0) for i in (0, 1)
    ]
    return SobolIndices(first[0], total[0], intervals[0], intervals[1], count, len(table) - count)


def _indices(means: Array, parameters: int) -> tuple[Array, Array]:
    """First order and total (R, d) from the means (R, 2 d + 2); NaN for a sample of a single
    repeated point.
    """
    variance = means[:, -1:] - means[:, -2:-1] ** 2
    variance = np.where(variance > 0, variance, np.nan)
    first = means[:, :parameters] / variance
    total = means[:, parameters : 2 * parameters] / variance
    return first, total


def sensitivity_table(paths: Sequence[str], indices: Mapping[str, SobolIndices]) -> Table:
    """The Sobol indices of each metric with respect to each parameter, with their confidence
    intervals.
    """
    all_indices = indices.values()

    def pairs(intervals: list[Array]) -> TableColumn:
        return TableColumn(
            list(zip(*np.hstack(intervals).tolist(), strict=True)), digits=3, brief=False
        )

    columns = {
        "metric": [name for name in indices for _ in paths],
        "parameter": [*paths] * len(indices),
        "first order": TableColumn(
            np.concatenate([sobol.first for sobol in all_indices]), digits=3
        ),
        "first order, interval": pairs([sobol.first_interval for sobol in all_indices]),
        "total": TableColumn(np.concatenate([sobol.total for sobol in all_indices]), digits=3),
        "total, interval": pairs([sobol.total_interval for sobol in all_indices]),
    }
    note = (
        "Intervals: 95 % bootstrap confidence intervals. First order: fraction of the variance"
        " removed if the parameter were known; total: fraction that remains if all other parameters"
        " were known."
    )
    title = "Variance-based sensitivities (Sobol indices)"
    return Table("sensitivities", title, columns, note, brief=MAX_SENSITIVITIES)


def sensitivity_figure(paths: Sequence[str], indices: Mapping[str, SobolIndices]) -> Any:
    """First order and total index of each metric as bars."""
    count = len(indices)
    figure, axes = new_figure(
        count, 1, height=0.8 + count * (0.7 + 0.42 * len(paths)), squeeze=False, sharex=True
    )
    rows = np.arange(len(paths))
    bar = {"height": 0.38, "error_kw": {"elinewidth": 0.9, "ecolor": BLACK, "capsize": 2}}
    for axis, (name, index) in zip(axes[:, 0], indices.items(), strict=True):
        for values, interval, shift, colour, label in (
            (index.first, index.first_interval, -0.2, BLUE, "first order"),
            (index.total, index.total_interval, 0.2, ORANGE, "total"),
        ):
            errors = np.abs(np.nan_to_num(interval - values))
            axis.barh(
                rows + shift, np.nan_to_num(values), xerr=errors, color=colour, label=label, **bar
            )
        axis.set_yticks(rows, paths)
        axis.invert_yaxis()
        axis.set_title(name if np.isfinite(index.total).any() else f"{name}: does not vary")
        axis.axvline(0.0, color=BLACK, linewidth=0.8)
        axis.grid(False, axis="y")
    axes[-1, 0].set_xlabel("fraction of the variance")
    legend_below(figure, axes[0, 0])
    return figure
