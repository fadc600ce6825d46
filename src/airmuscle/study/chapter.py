"""The chapter of a report that a study fills, and the files beside it."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from ..core.reference import cite
from ..report.chapter import Chapter, Table
from ..report.output_folder import atomic_folder
from ..report.write import save_table, write_into
from .distributions import LevelSet, Variation
from .plots import plots
from .result import StudyResult
from .sensitivity import Indices
from .study import Study

RESULTS, COURSES = "results.csv", "courses.npz"
MOST_LEVELS = 6
"""Levels that are written out; of more, the ends and their number."""
MOST_REASONS = 20


def write_study(result: StudyResult, folder: Path | str) -> Path:
    """Write results.csv, courses.npz where whole columns are kept, and the report; the path of its page.

    All of it appears, or nothing. Raises FileError where the folder cannot be written to.
    """
    study = result.study
    with atomic_folder(folder) as place:
        save_table(result.table(), place / RESULTS)
        if study.courses:
            times = {f"{name}_time": course.instants for name, course in study.courses.items()}
            np.savez(place / COURSES, **times, **result.courses)  # type: ignore[arg-type]
        write_into(place, [study_chapter(result)], title="Parameter study")
    return Path(folder) / "report.html"


def study_chapter(result: StudyResult) -> Chapter:
    """A study's design, statistics, sensitivities and figures."""
    study, indices = result.study, result.indices()
    tables = [varied_table(study)]
    tables += [result.statistics()] if study.scalars else []
    tables += [sensitivity_table(study, indices)] if indices else []
    tables += [reasons_table(result)] if result.failed.size else []
    return Chapter(
        paper="study",
        title=study.title,
        summary="\n\n".join(summary(result, indices)),
        plots=plots(result, indices),
        tables=tuple(tables),
        references=tuple(cite(study.source.scenario.plant)),
        chosen=_settings(study),
    )


def summary(result: StudyResult, indices: dict[str, Indices]) -> list[str]:
    """What a reader should know before looking at any number."""
    study = result.study
    said = [f"{len(study)} runs, {study.design}. All runs are in {RESULTS}, one a row."]
    if study.courses:
        said.append(f"Whole columns ({', '.join(study.courses)}) are in {COURSES}, a row a run, with their instants.")
    if result.failed.size:
        said.append(f"{result.failed.size} runs failed and are left out of all that follows; the table says why.")
    left_out = max((found.left_out for found in indices.values()), default=0)
    if left_out:
        said.append(f"Of the base points of the sensitivities {left_out} could not be used for some outcome.")
    return said


def varied_table(study: Study) -> Table:
    """What varies, and how."""
    return Table(
        "varied",
        "What varies",
        {
            "number": [number.path for number in study.numbers],
            "unit": [number.unit for number in study.numbers],
            "values": [in_words(variation) for variation in study.variations],
            "min": study.values.min(axis=0),
            "max": study.values.max(axis=0),
            "followed by": [_followers(study, i) for i in range(len(study.numbers))],
        },
        "Values are SI.",
    )


def _followers(study: Study, place: int) -> str:
    return ", ".join(number.path for number, leader in study.follow if leader == place)


def in_words(variation: Variation) -> str:
    """A variation on one line."""
    if not isinstance(variation, LevelSet):
        return str(variation)
    if len(variation.values) > MOST_LEVELS:
        low, high = variation.ends
        return f"{len(variation.values)} values from {low:g} to {high:g}"
    return ", ".join(f"{value:g}" for value in variation.values)


def sensitivity_table(study: Study, indices: dict[str, Indices]) -> Table:
    """The Sobol indices of every outcome by every input, with their intervals."""
    rows = [(name, number.path, i) for name in indices for i, number in enumerate(study.numbers)]

    def column(part: str, row: int | None = None) -> list[float]:
        found = [getattr(indices[name], part) for name, _, _ in rows]
        return [float((f if row is None else f[row])[i]) for f, (_, _, i) in zip(found, rows, strict=True)]

    return Table(
        "sensitivities",
        "Variance-based sensitivities",
        {
            "outcome": [name for name, _, _ in rows],
            "input": [path for _, path, _ in rows],
            "first order": column("first"),
            "from": column("first_interval", 0),
            "to": column("first_interval", 1),
            "total": column("total"),
            "from ": column("total_interval", 0),
            "to ": column("total_interval", 1),
        },
        "Intervals are 95 %, by bootstrap. First order: the part of the variance that would go if the input were "
        "known; total: the part that would stay if all others were.",
    )


def reasons_table(result: StudyResult) -> Table:
    """Why runs failed, the most frequent reason first."""
    counted = Counter(result.reasons[i] for i in result.failed).most_common(MOST_REASONS)
    return Table(
        "failed",
        "RunSplit that failed",
        {
            "runs": [count for _, count in counted],
            "first": [result.reasons.index(reason) for reason, _ in counted],
            "reason": [reason for reason, _ in counted],
        },
        f"The {MOST_REASONS} most frequent reasons at most." if len(counted) == MOST_REASONS else "",
    )


def _settings(study: Study) -> tuple[tuple[str, str, str], ...]:
    scenario = study.source.scenario
    outcomes = [(f"outcome {name}", str(outcome), "study") for name, outcome in study.outcomes.items()]
    return (
        ("scenario", scenario.title, str(study.path.name)),
        ("design", str(study.design), "study"),
        *outcomes,
        ("method", str(scenario.method), "scenario"),
        ("command", str(scenario.command), "scenario"),
    )
