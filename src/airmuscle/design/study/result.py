"""Result of a parameter study with its chapter, and its files: metrics, statistics, sensitivities
and failures.
"""

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...bench.reported import Reported
from ...core import Array, ColumnError, atomic_folder, check_known, cite
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.write import save_table, write_into
from . import Saltelli, Study
from .figures import file_stem, histogram_figure, scatter_plot, time_series_figure
from .sensitivity import SobolIndices, sensitivity_figure, sensitivity_table, sobol_indices

BRIEF = ("mean", "standard deviation", "5 %", "95 %")
MAX_BRIEF = 8
SHORT_LISTED = 4
"""Statistics, number of metrics and of reasons of failed runs in the brief view (chosen)."""
RESULTS_FILE = "results.csv"
TIME_SERIES_FILE = "time_series.npz"
MAX_LISTED_REASONS = 20
HISTOGRAMS = "Histograms of the metrics over all runs; the dashed line is the nominal scenario."
SENSITIVITIES = (
    "Variance-based sensitivities with 95 % bootstrap confidence intervals: first order (the"
    " parameter alone) and total (with its interactions)."
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StudyResult(Reported):
    """The results of all runs of a study.

    scalars          scalar metrics (N, k), in the order of `study.scalars`; NaN if a run does not
                     have the metric
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
        """A metric by its name: (N,) for a scalar, (N, T) for a time series. Raises ColumnError if
        it is unknown.
        """
        if name in self.time_series:
            return self.time_series[name]
        names = list(self.study.scalars)
        check_known(
            "study: no metric", name, [*names, *self.time_series], "the metrics are", ColumnError
        )
        return self.scalars[:, names.index(name)]

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """The indices of the failed runs."""
        return np.flatnonzero([bool(reason) for reason in self.failure_reasons])

    def table(self) -> Table:
        """One row per run: parameter values, scalar metrics, status, and the reason of a
        failure.
        """
        study = self.study
        inputs = {
            f"{p.path} [{p.unit}]": study.values[:, i] for i, p in enumerate(study.parameters)
        }
        metrics = {f"{name} [{study.units[name]}]": self[name] for name in study.scalars}
        status = ["failed" if reason else "done" for reason in self.failure_reasons]
        columns: dict[str, Any] = {
            "run": list(range(len(study))),
            **inputs,
            **metrics,
            "status": status,
        }
        return Table(
            "results", "All runs", {**columns, "reason": list(self.failure_reasons)}, series=True
        )

    def statistics(self) -> Table:
        """The nominal value and the statistics over all runs of each scalar metric."""
        names = list(self.study.scalars)
        rows = [_statistics(self[name]) for name in self.study.scalars]
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
            "statistics",
            "Metrics",
            columns,
            "Statistics of all runs that have the metric.",
            brief=MAX_BRIEF,
        )

    def indices(self) -> dict[str, SobolIndices]:
        """The Sobol indices of each scalar metric; empty for designs other than Saltelli."""
        design = self.study.design
        if not isinstance(design, Saltelli):
            return {}
        return {
            name: sobol_indices(self[name], len(self.study.parameters), design.seed)
            for name in self.study.scalars
        }

    def chapter(self) -> Chapter:
        """The description of the study: design, statistics, sensitivities and figures."""
        study = self.study
        indices = self.indices()
        metrics = {name: self[name] for name in study.scalars}
        paths = [parameter.path for parameter in study.parameters]
        plots = (
            [
                Plot(
                    "histograms",
                    HISTOGRAMS,
                    partial(histogram_figure, study, metrics, self.nominal),
                )
            ]
            if metrics
            else []
        )
        plots += [scatter_plot(study, name, values) for name, values in metrics.items()]
        plots += (
            [Plot("sensitivities", SENSITIVITIES, partial(sensitivity_figure, paths, indices))]
            if indices
            else []
        )
        for name, series in study.time_series.items():
            caption = f"{name}: {series.column} over time, over all runs."
            figure = partial(time_series_figure, study, name, self[name])
            plots.append(Plot(f"time-series-{file_stem(name)}", caption, figure))
        tables = [self.statistics()] if metrics else []
        tables += [sensitivity_table(paths, indices)] if indices else []
        tables += [self._failure_table()] if self.failed.size else []
        summary = [f"{len(study)} runs, {study.design}. {RESULTS_FILE} contains one row per run."]
        if study.time_series:
            names = ", ".join(study.time_series)
            summary.append(
                f"{TIME_SERIES_FILE} contains the time series ({names}), one row per run, and their"
                " times."
            )
        counts = {"runs": len(study), "failed runs": int(self.failed.size)}
        return Chapter(
            "study",
            study.title,
            tuple(summary),
            plots=tuple(plots),
            tables=(*tables, variation_table(study)),
            values=tuple(NamedValue(name, count, brief=False) for name, count in counts.items()),
            chosen=_settings(study),
            notes=tuple(self._notes(indices)),
            references=tuple(cite(study.template.scenario.plant)),
        )

    def _notes(self, indices: dict[str, SobolIndices]) -> Iterator[str]:
        """Failed runs and excluded base points."""
        if self.failed.size:
            yield (
                f"Failed runs: {self.failed.size}. They are excluded from the statistics; the table"
                " has the reasons."
            )
        excluded = max((sobol.excluded_points for sobol in indices.values()), default=0)
        if excluded:
            yield (
                "Base points excluded from the sensitivities, because a metric is missing:"
                f" {excluded}."
            )

    def _failure_table(self) -> Table:
        """The reasons of failed runs, the most frequent first."""
        counts = Counter(self.failure_reasons[i] for i in self.failed).most_common(
            MAX_LISTED_REASONS
        )
        columns: dict[str, Any] = {
            "runs": [count for _, count in counts],
            "first run": [self.failure_reasons.index(reason) for reason, _ in counts],
            "reason": [reason for reason, _ in counts],
        }
        note = (
            f"At most {MAX_LISTED_REASONS} reasons are listed."
            if len(counts) == MAX_LISTED_REASONS
            else ""
        )
        return Table("failed", "Failed runs", columns, note, brief=SHORT_LISTED)


def _settings(study: Study) -> tuple[tuple[str, str, str], ...]:
    scenario = study.template.scenario
    return (
        ("scenario", scenario.title, str(study.path.name)),
        ("design", str(study.design), "study"),
        *((f"metric {name}", str(metric), "study") for name, metric in study.metrics.items()),
        ("integrator", str(scenario.problem.integrator), "scenario"),
        ("input signal", str(scenario.problem.input), "scenario"),
    )


def _statistics(values: Array) -> dict[str, Any]:
    finite = values[np.isfinite(values)]
    names = ("min", "5 %", "median", "95 %", "max")
    quantiles = (
        np.quantile(finite, [0.0, 0.05, 0.5, 0.95, 1.0]) if finite.size else np.full(5, np.nan)
    )
    return {
        "runs": int(finite.size),
        "mean": float(finite.mean()) if finite.size else np.nan,
        "standard deviation": float(finite.std(ddof=1)) if finite.size > 1 else np.nan,
        **dict(zip(names, quantiles.tolist(), strict=True)),
    }


def variation_table(study: Study) -> Table:
    """The varied parameters with their distributions or levels and their sampled range."""
    columns: dict[str, Any] = {
        "parameter": [parameter.path for parameter in study.parameters],
        "values": list(map(str, study.variations)),
        "min": TableColumn(study.values.min(axis=0), BY_ROW),
        "max": TableColumn(study.values.max(axis=0), BY_ROW),
        "unit": [parameter.unit for parameter in study.parameters],
        "also applied to": [
            ", ".join(parameter.path for parameter, leader in study.follow if leader == i)
            for i in range(len(study.parameters))
        ],
    }
    return Table("varied", "Varied parameters", columns)


def write_study(result: StudyResult, folder: Path | str, chapter: Chapter | None = None) -> Path:
    """Write results.csv, time_series.npz (if the study has time series) and the report; return the
    path of its page.

    The files are written atomically: all or none. `chapter` is that of the result, if it was made
    before. Raises FileError if the folder cannot be written to.
    """
    study = result.study
    with atomic_folder(folder) as place:
        save_table(result.table(), place / RESULTS_FILE)
        if study.time_series:
            times = {f"{name}_time": course.times for name, course in study.time_series.items()}
            np.savez(place / TIME_SERIES_FILE, **times, **result.time_series)  # type: ignore[arg-type]
        write_into(place, [chapter or result.chapter()], title="Parameter study")
    return Path(folder) / "report.html"
