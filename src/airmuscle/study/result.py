"""What a study found: outcomes run by run, their statistics, and which input they come from."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..report.chapter import Table
from .design import Saltelli
from .sensitivity import SobolIndices, sobol_indices
from .study import Study


@dataclasses.dataclass(frozen=True, eq=False)
class StudyResult:
    """All runs of a study.

    numbers  (N, k) the outcomes that are numbers, in the order of `study.scalars`; NaN where a run does not have it
    courses  by name (N, T), whole columns at `study.courses[name].instants`
    reasons  (N,) why a run failed, empty where it did not
    nominal  the outcomes of the scenario as it stands
    """

    study: Study
    scalars: Array
    time_series: Mapping[str, Array]
    failure_reasons: tuple[str, ...]
    nominal: Mapping[str, float]

    def __getitem__(self, name: str) -> Array:
        """An outcome by its name: (N,) of a number, (N, T) of a course. KeyError where there is none."""
        return (
            self.time_series[name]
            if name in self.time_series
            else self.scalars[:, list(self.study.scalars).index(name)]
        )

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """The runs that failed."""
        return np.flatnonzero([bool(reason) for reason in self.failure_reasons])

    def table(self) -> Table:
        """One row a run: what varied, what came out, and whether it failed."""
        study = self.study
        inputs = {f"{n.path} [{n.unit}]": study.values[:, i] for i, n in enumerate(study.parameters)}
        outcomes = {f"{name} [{study.units[name]}]": self[name] for name in study.scalars}
        status = ["failed" if reason else "done" for reason in self.failure_reasons]
        runs: list[Any] = list(range(len(study)))
        columns: dict[str, Any] = {
            "run": runs,
            **inputs,
            **outcomes,
            "status": status,
            "reason": list(self.failure_reasons),
        }
        return Table("results", "All runs", columns, shown=False)

    def statistics(self) -> Table:
        """Of every outcome that is a number: the scenario as it stands, and how the runs are spread."""
        found = [_statistics(self[name]) for name in self.study.scalars]
        return Table(
            "statistics",
            "Outcomes",
            {
                "outcome": list(self.study.scalars),
                "unit": [self.study.units[name] for name in self.study.scalars],
                "as it stands": [self.nominal[name] for name in self.study.scalars],
                **{key: [row[key] for row in found] for key in found[0]},
            }
            if found
            else {},
            "Over all runs that have the outcome.",
        )

    def indices(self) -> dict[str, SobolIndices]:
        """Variance-based sensitivities of every outcome that is a number; empty for other designs than Saltelli."""
        design = self.study.design
        if not isinstance(design, Saltelli):
            return {}
        return {name: sobol_indices(self[name], len(self.study.parameters), design.seed) for name in self.study.scalars}


def _statistics(values: Array) -> dict[str, float]:
    there = values[np.isfinite(values)]
    names = ("min", "5 %", "median", "95 %", "max")
    quantiles = np.quantile(there, [0.0, 0.05, 0.5, 0.95, 1.0]) if there.size else np.full(5, np.nan)
    return {
        "runs": int(there.size),
        "mean": float(there.mean()) if there.size else np.nan,
        "standard deviation": float(there.std(ddof=1)) if there.size > 1 else np.nan,
        **dict(zip(names, quantiles.tolist(), strict=True)),
    }
