"""StudyResult: metrics, statistics and sensitivity indices of a study."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import ColumnError, suggestion
from ...core.short_repr import ShortRepr
from ...report.chapter import BY_ROW, Table, TableColumn
from .design import Saltelli
from .sensitivity import SobolIndices, sobol_indices
from .study import Study

BRIEF, MAX_BRIEF = ("mean", "standard deviation", "5 %", "95 %"), 8
"""Statistics and number of metrics in the brief view (chosen)."""


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
        if name not in names:
            known = [*names, *self.time_series]
            raise ColumnError(
                f"study: no metric '{name}'; the metrics are {', '.join(known)}.{suggestion(name, known)}"
            )
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
        return Table(
            "statistics", "Metrics", columns, "Statistics over all runs that have the metric.", brief=MAX_BRIEF
        )

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
