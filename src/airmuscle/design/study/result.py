"""StudyResult: metrics, statistics and variance-based sensitivity indices of a study.

First order   S_i = V(E(f | x_i)) / V(f)              fraction of the variance removed if x_i were known
total         T_i = 1 - V(E(f | x_others)) / V(f)     fraction that remains if only x_i were unknown

estimated from the runs A, B and A with column i from B (the design Saltelli), with f centred about its mean:
    S_i = mean(f_B (f_ABi - f_A)) / V,   T_i = mean((f_A - f_ABi)^2) / (2 V),   V = variance of f_A and f_B together.
The T_i are not negative, and their sum is at least 1; the sum of the S_i is at most 1; T_i - S_i is the contribution of
the interactions of x_i with other parameters. Estimates of small S_i may be negative.

References: Sobol, Math. and Computers in Simulation 55 (2001) 271-280; Jansen, Computer Physics Communications 117
(1999) 35-43 (T_i); Saltelli et al., Computer Physics Communications 181 (2010) 259-270 (S_i, and the design).
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, ColumnError, ShortRepr, check_known
from ...report.chapter import BY_ROW, Table, TableColumn
from . import Saltelli, Study

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
    known = table[np.isfinite(table).all(axis=1)]
    count, undefined = len(known), np.full(parameters, np.nan)
    varies = len(known) and np.ptp(known) > 1e-12 * np.abs(known).max() and np.ptp(known[:, [0, -1]]) > 0
    if not varies:  # by more than rounding errors
        no_interval = np.tile(undefined, (2, 1))
        return SobolIndices(undefined, undefined, no_interval, no_interval, count, len(table) - count)
    centred = known - known[:, [0, -1]].mean()
    a, mixed, b = centred[:, :1], centred[:, 1:-1], centred[:, -1:]
    # what the estimators average, per base point (n, 2 d + 2); a bootstrap sample is a matrix product
    terms = np.hstack([b * (mixed - a), 0.5 * (a - mixed) ** 2, 0.5 * (a + b), 0.5 * (a * a + b * b)])
    first, total = _indices(terms.mean(axis=0)[None, :], parameters)
    generator = np.random.default_rng(seed)
    samples = []
    for _ in range(BOOTSTRAP_SAMPLES // SAMPLES_PER_BATCH):  # in batches, to bound the memory
        weights = generator.multinomial(count, np.full(count, 1.0 / count), size=SAMPLES_PER_BATCH)
        samples.append(_indices(weights @ terms / count, parameters))
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    intervals = [np.nanquantile(np.concatenate([pair[i] for pair in samples]), tails, axis=0) for i in (0, 1)]
    return SobolIndices(first[0], total[0], intervals[0], intervals[1], count, len(table) - count)


def _indices(means: Array, parameters: int) -> tuple[Array, Array]:
    """First order and total (R, d) from the means (R, 2 d + 2); NaN for a sample of a single repeated point."""
    variance = means[:, -1:] - means[:, -2:-1] ** 2
    variance = np.where(variance > 0, variance, np.nan)
    return means[:, :parameters] / variance, means[:, parameters : 2 * parameters] / variance


BRIEF, MAX_BRIEF, MAX_SENSITIVITIES = ("mean", "standard deviation", "5 %", "95 %"), 8, 12
"""Statistics, number of metrics and rows of sensitivities in the brief view (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StudyResult(ShortRepr):
    """The results of all runs of a study.

    scalars          scalar metrics (N, k), in the order of `study.scalars`; NaN if a run does not have the metric
    time_series      time series by name (N, T), at the times `study.time_series[name].times`
    failure_reasons  reason of each failed run (N,); empty for other runs
    nominal          scalar metrics of the nominal scenario, without variations
    """

    study: Study
    scalars: Array
    time_series: Mapping[str, Array]
    failure_reasons: tuple[str, ...]
    nominal: Mapping[str, float]

    def __getitem__(self, name: str) -> Array:
        """A metric by its name: (N,) for a scalar, (N, T) for a time series. Raises ColumnError if it is unknown."""
        if name in self.time_series:
            return self.time_series[name]
        names = list(self.study.scalars)
        check_known("study: no metric", name, [*names, *self.time_series], "the metrics are", ColumnError)
        return self.scalars[:, names.index(name)]

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """The indices of the failed runs."""
        return np.flatnonzero([bool(reason) for reason in self.failure_reasons])

    def table(self) -> Table:
        """One row per run: parameter values, scalar metrics, status, and the reason of a failure."""
        study = self.study
        inputs = {f"{p.path} [{p.unit}]": study.values[:, i] for i, p in enumerate(study.parameters)}
        metrics = {f"{name} [{study.units[name]}]": self[name] for name in study.scalars}
        status = ["failed" if reason else "done" for reason in self.failure_reasons]
        runs: list[Any] = list(range(len(study)))
        reasons = list(self.failure_reasons)
        columns: dict[str, Any] = {"run": runs, **inputs, **metrics, "status": status, "reason": reasons}
        return Table("results", "All runs", columns, series=True)

    def statistics(self) -> Table:
        """The nominal value and the statistics over all runs of each scalar metric."""
        names = list(self.study.scalars)
        rows = [_statistics(self[name]) for name in names]
        columns: dict[str, Any] = {
            "metric": names,
            "nominal": TableColumn([self.nominal[name] for name in names], BY_ROW),
            "runs": TableColumn([row.pop("runs") for row in rows], brief=False),
            **{
                key: TableColumn([row[key] for row in rows], BY_ROW, brief=key in BRIEF)
                for key in (rows[0] if rows else ())
            },
            "unit": [self.study.units[name] for name in names],
        }
        return Table("statistics", "Metrics", columns, "Statistics of all runs that have the metric.", brief=MAX_BRIEF)

    def indices(self) -> dict[str, SobolIndices]:
        """The Sobol indices of each scalar metric; empty for designs other than Saltelli."""
        design = self.study.design
        if not isinstance(design, Saltelli):
            return {}
        return {name: sobol_indices(self[name], len(self.study.parameters), design.seed) for name in self.study.scalars}


def _statistics(values: Array) -> dict[str, Any]:
    finite = values[np.isfinite(values)]
    names = ("min", "5 %", "median", "95 %", "max")
    quantiles = np.quantile(finite, [0.0, 0.05, 0.5, 0.95, 1.0]) if finite.size else np.full(5, np.nan)
    return {
        "runs": int(finite.size),
        "mean": float(finite.mean()) if finite.size else np.nan,
        "standard deviation": float(finite.std(ddof=1)) if finite.size > 1 else np.nan,
        **dict(zip(names, quantiles.tolist(), strict=True)),
    }


def sensitivity_table(study: Study, indices: dict[str, SobolIndices]) -> Table:
    """The Sobol indices of each metric with respect to each parameter, with their confidence intervals."""
    paths, found = [parameter.path for parameter in study.parameters], indices.values()

    def pairs(intervals: list[Array]) -> TableColumn:
        return TableColumn(list(zip(*np.hstack(intervals).tolist(), strict=True)), digits=3, brief=False)

    columns = {
        "metric": [name for name in indices for _ in paths],
        "parameter": paths * len(indices),
        "first order": TableColumn(np.concatenate([each.first for each in found]), digits=3),
        "first order, interval": pairs([each.first_interval for each in found]),
        "total": TableColumn(np.concatenate([each.total for each in found]), digits=3),
        "total, interval": pairs([each.total_interval for each in found]),
    }
    note = (
        "Intervals: 95 % bootstrap confidence intervals. First order: fraction of the variance removed if the "
        "parameter were known; total: fraction that remains if all other parameters were known."
    )
    title = "Variance-based sensitivities (Sobol indices)"
    return Table("sensitivities", title, columns, note, brief=MAX_SENSITIVITIES)
