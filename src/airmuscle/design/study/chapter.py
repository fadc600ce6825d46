"""Report chapter of a parameter study, and its result files."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...core import atomic_folder, cite
from ...report.chapter import BY_ROW, Chapter, NamedValue, Table, TableColumn
from ...report.write import save_table, write_into
from .distributions import LevelSet, Variation
from .plots import study_plots
from .result import SobolIndices, StudyResult
from .study import Study

RESULTS_FILE, TIME_SERIES_FILE = "results.csv", "time_series.npz"
MAX_LISTED_LEVELS = 6
"""Maximum number of levels that are listed; of more levels, only range and number are printed."""
MAX_LISTED_REASONS = 20
MAX_SENSITIVITIES, SHORT_LISTED = 12, 4
"""Rows of the brief view: sensitivities, and reasons of failed runs (chosen)."""


def write_study(result: StudyResult, folder: Path | str, chapter: Chapter | None = None) -> Path:
    """Write results.csv, time_series.npz (if the study has time series) and the report; return the path of its page.

    The files are written atomically: all or none. `chapter` is that of the result, if it was made before. Raises
    FileError if the folder cannot be written to.
    """
    study = result.study
    with atomic_folder(folder) as place:
        save_table(result.table(), place / RESULTS_FILE)
        if study.time_series:
            times = {f"{name}_time": course.times for name, course in study.time_series.items()}
            np.savez(place / TIME_SERIES_FILE, **times, **result.time_series)  # type: ignore[arg-type]
        write_into(place, [chapter or study_chapter(result)], title="Parameter study")
    return Path(folder) / "report.html"


def study_chapter(result: StudyResult, *, execution: str = "") -> Chapter:
    """The report chapter: design, statistics, sensitivities and figures of a study.

    `execution` is a paragraph on the processes that have computed the runs.
    """
    study, indices = result.study, result.indices()
    tables = [result.statistics()] if study.scalars else []
    tables += [sensitivity_table(study, indices)] if indices else []
    tables += [failure_table(result)] if result.failed.size else []
    return Chapter(
        name="study",
        title=study.title,
        summary=(*summary(result), execution),
        values=(
            NamedValue("runs", len(study), brief=False),
            NamedValue("failed runs", int(result.failed.size), brief=False),
        ),
        plots=study_plots(result, indices),
        tables=(*tables, variation_table(study)),
        notes=tuple(_notes(result, indices)),
        references=tuple(cite(study.template.scenario.plant)),
        chosen=_settings(study),
    )


def summary(result: StudyResult) -> Iterator[str]:
    """The paragraphs above the tables: number of runs, files."""
    study = result.study
    yield f"{len(study)} runs, {study.design}. {RESULTS_FILE} contains one row per run."
    if study.time_series:
        names = ", ".join(study.time_series)
        yield f"{TIME_SERIES_FILE} contains the time series ({names}), one row per run, and their times."


def _notes(result: StudyResult, indices: dict[str, SobolIndices]) -> Iterator[str]:
    """Failed runs and excluded base points."""
    if result.failed.size:
        yield (
            f"Failed runs: {result.failed.size}. They are excluded from the statistics; the table states the reasons."
        )
    excluded = max((each.excluded_points for each in indices.values()), default=0)
    if excluded:
        yield f"Base points excluded from the sensitivities, because a metric is missing: {excluded}."


def variation_table(study: Study) -> Table:
    """The varied parameters with their distributions or levels and their sampled range."""
    columns: dict[str, Any] = {
        "parameter": [parameter.path for parameter in study.parameters],
        "values": [describe_variation(variation) for variation in study.variations],
        "min": TableColumn(study.values.min(axis=0), BY_ROW),
        "max": TableColumn(study.values.max(axis=0), BY_ROW),
        "unit": [parameter.unit for parameter in study.parameters],
        "also applied to": [_follower_paths(study, i) for i in range(len(study.parameters))],
    }
    return Table("varied", "Varied parameters", columns)


def _follower_paths(study: Study, index: int) -> str:
    return ", ".join(parameter.path for parameter, leader in study.follow if leader == index)


def describe_variation(variation: Variation) -> str:
    """A variation as one line of text."""
    if not isinstance(variation, LevelSet):
        return str(variation)
    if len(variation.values) > MAX_LISTED_LEVELS:
        low, high = variation.support
        return f"{len(variation.values)} values from {low:.4g} to {high:.4g}"
    return ", ".join(f"{value:.4g}" for value in variation.values)


def sensitivity_table(study: Study, indices: dict[str, SobolIndices]) -> Table:
    """The Sobol indices of each metric with respect to each parameter, with their confidence intervals."""
    rows = [(name, parameter.path, i) for name in indices for i, parameter in enumerate(study.parameters)]

    def column(field: str, bound: int | None = None) -> list[float]:
        values = [getattr(indices[name], field) for name, _, _ in rows]
        return [float((v if bound is None else v[bound])[i]) for v, (_, _, i) in zip(values, rows, strict=True)]

    columns = {
        "metric": [name for name, _, _ in rows],
        "parameter": [path for _, path, _ in rows],
        "first order": TableColumn(column("first"), digits=3),
        "first order, interval": _pairs(column("first_interval", 0), column("first_interval", 1)),
        "total": TableColumn(column("total"), digits=3),
        "total, interval": _pairs(column("total_interval", 0), column("total_interval", 1)),
    }
    note = (
        "Intervals: 95 % bootstrap confidence intervals. First order: fraction of the variance removed if the "
        "parameter were known; total: fraction that remains if all other parameters were known."
    )
    title = "Variance-based sensitivities (Sobol indices)"
    return Table("sensitivities", title, columns, note, brief=MAX_SENSITIVITIES)


def _pairs(low: list[float], high: list[float]) -> TableColumn:
    return TableColumn(list(zip(low, high, strict=True)), digits=3, brief=False)


def failure_table(result: StudyResult) -> Table:
    """The reasons of failed runs, the most frequent first."""
    counts = Counter(result.failure_reasons[i] for i in result.failed).most_common(MAX_LISTED_REASONS)
    columns: dict[str, Any] = {
        "runs": [count for _, count in counts],
        "first run": [result.failure_reasons.index(reason) for reason, _ in counts],
        "reason": [reason for reason, _ in counts],
    }
    note = f"At most {MAX_LISTED_REASONS} reasons are listed." if len(counts) == MAX_LISTED_REASONS else ""
    return Table("failed", "Failed runs", columns, note, brief=SHORT_LISTED)


def _settings(study: Study) -> tuple[tuple[str, str, str], ...]:
    scenario = study.template.scenario
    metrics = [(f"metric {name}", str(metric), "study") for name, metric in study.metrics.items()]
    return (
        ("scenario", scenario.title, str(study.path.name)),
        ("design", str(study.design), "study"),
        *metrics,
        ("integrator", str(scenario.problem.integrator), "scenario"),
        ("input signal", str(scenario.problem.input), "scenario"),
    )
