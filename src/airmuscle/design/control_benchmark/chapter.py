"""Report chapter of the control benchmark: ranking, tables of the metrics, tuned gains, figures."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from ...core.reference import Reference, cite
from ...report.chapter import Chapter, Table
from ...report.write import write_report
from ..tuning import Tuning
from .benchmark import BenchmarkResult, TunedContender
from .learning import LearningCurve
from .plots import benchmark_plots
from .tracking_metrics import BONE2019, RATED_STROKES, SETTLING_BAND, STEADY_TIME, TrackingMetrics

HEADERS = {
    "rmse": "rms error [deg]",
    "max_error": "maximum error [deg]",
    "itae": "ITAE [deg s^2]",
    "settling": "settling time [s]",
    "overshoot": "overshoot [%]",
    "steady": "steady-state error [deg]",
    "air": "air [l/s (ANR)]",
    "strokes": "valve strokes [1/s]",
    "valve_life": "valve life [h]",
    "stiffness_error": "stiffness error [%]",
}
"""Headers of the metrics, by the fields of TrackingMetrics."""


def write_benchmark(result: BenchmarkResult, folder: Path | str, curves: Sequence[LearningCurve] = ()) -> Path:
    """Write the report of a benchmark with tables as CSV and figures, all or none; return the path of its page."""
    return write_report([benchmark_chapter(result, curves)], folder, title="Control benchmark")


def benchmark_chapter(result: BenchmarkResult, curves: Sequence[LearningCurve] = ()) -> Chapter:
    """The chapter of a benchmark: ranking, errors, all metrics, gains, figures."""
    tables = [ranking_table(result), error_table(result, "rmse"), error_table(result, "max_error")]
    tables += [metrics_table(result)]
    tables += [gains] if (gains := gains_table(result)) else []
    tables += [learning_table(curves)] if curves else []
    tables += [failures] if (failures := failure_table(result)) else []
    return Chapter(
        paper="benchmark",
        title=f"Control of an antagonistic joint with {result.joint.name}",
        summary="\n\n".join(_summary(result)),
        tables=tuple(tables),
        plots=benchmark_plots(result, curves),
        references=_references(result),
        chosen=_settings(result),
    )


def ranking_table(result: BenchmarkResult) -> Table:
    """The contenders by score, with mean air and strokes over the tasks."""
    scores = result.scores()
    return Table(
        "ranking",
        "Ranking",
        {
            "controller": list(scores),
            "score": list(scores.values()),
            "air, mean [l/s (ANR)]": [_mean(result, name, "air") for name in scores],
            "valve strokes, mean [1/s]": [_mean(result, name, "strokes") for name in scores],
            "tasks completed": [_completed(result, name) for name in scores],
        },
        "Score: geometric mean over the tasks of the rms error, divided by the smallest of all controllers; 1 is the "
        "best in every task.",
    )  # fmt: skip


def _completed(result: BenchmarkResult, name: str) -> int:
    return sum(result.runs[name, task.name].metrics is not None for task in result.tasks)


def _mean(result: BenchmarkResult, name: str, metric: str) -> float:
    values = [result.metric(name, task.name, metric) for task in result.tasks]
    return sum(values) / len(values)


def error_table(result: BenchmarkResult, metric: str) -> Table:
    """One metric of all controllers, one row for each task."""
    names = [each.name for each in result.contenders]
    columns: dict[str, list[str] | list[float]] = {"task": [task.name for task in result.tasks]}
    columns |= {name: [result.metric(name, task.name, metric) for task in result.tasks] for name in names}
    return Table(metric, _title(HEADERS[metric]), columns, "From the beginning of the judged time of each task.")


def _title(heading: str) -> str:
    return heading[0].upper() + heading[1:] if not heading.startswith("rms") else f"RMS{heading[3:]}"


def metrics_table(result: BenchmarkResult) -> Table:
    """All metrics, one row for each task and controller."""
    keys = list(result.runs)
    columns: dict[str, list[str] | list[float]] = {
        "controller": [name for name, _ in keys],
        "task": [task for _, task in keys],
    }
    for field in dataclasses.fields(TrackingMetrics):
        columns[HEADERS[field.name]] = [result.metric(*key, field.name) for key in keys]
    return Table(
        "metrics",
        "All metrics",
        columns,
        f"Settling: until the error remains within {SETTLING_BAND:g} degrees. Steady-state error: mean of the last "
        f"{STEADY_TIME:g} s. Valve life: of the busiest valve at {RATED_STROKES:g} openings (chosen). Stiffness error: "
        "of the true stiffness of the muscles against that wanted.",
    )


def gains_table(result: BenchmarkResult) -> Table | None:
    """The gains that tuning found, in SI units; None if nothing was tuned."""
    rows = [
        (
            each.name,
            path,
            each.identified.get(path, value),
            _remark(each, each.tuning, path),
            each.tuning.objective,
        )
        for each in result.contenders
        if each.tuning is not None
        for path, value in each.tuning.gains.items()
    ]
    if not rows:
        return None
    names = ("controller", "gain", "value [SI]", "remark", "objective [deg]")
    return Table(
        "gains", "Tuned gains", {name: [row[i] for row in rows] for i, name in enumerate(names)},
        f"Found by the same optimiser with {result.budget} simulated loops for each controller, seed {result.seed}, "
        f"for {len(result.joint.family)} perturbed models. The truth is not among them, "
        "except for a gain that is identified: it is sought afterwards by runs on the truth, judged by its encoder.",
    )  # fmt: skip


def _remark(contender: TunedContender, tuning: Tuning, path: str) -> str:
    if path in contender.identified:
        return "identified"
    return "on a bound" if path in tuning.on_bound else ""


def learning_table(curves: Sequence[LearningCurve]) -> Table:
    """The rms errors of repeated trials."""
    columns: dict[str, list[int] | list[float]] = {"trial": list(range(1, max(c.errors.size for c in curves) + 1))}
    columns |= {f"{curve.contender}, {curve.task.name} [deg]": curve.errors.tolist() for curve in curves}
    return Table("learning", "Iterative learning", columns, "rms error of each trial; the first is without learning.")


def failure_table(result: BenchmarkResult) -> Table | None:
    """The runs that ended early, with their reasons; None if there are none."""
    failed = [(name, task, run.reason) for (name, task), run in result.runs.items() if run.metrics is None]
    if not failed:
        return None
    names = ("controller", "task", "reason")
    return Table("failed", "Runs that ended early", {n: [row[i] for row in failed] for i, n in enumerate(names)})


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"


def _summary(result: BenchmarkResult) -> list[str]:
    joint, best = result.joint, next(iter(result.scores()))
    return [
        f"{_counted(len(result.contenders), 'controller')}, {_counted(len(result.tasks), 'task')}. "
        f"Smallest score: {best}. Valves: {joint.valve}. Sampled every {joint.sample_time * 1e3:g} ms.",
        "Every controller was tuned by the same optimiser with the same budget for perturbed models. The plant on "
        "which it is judged differs from these models in kind: another characteristic, LuGre friction, tubes, heat "
        "transfer, another valve law, and other numbers. The measurements have the resolution of a 12-bit encoder, "
        "noise and dead time.",
    ]


def _references(result: BenchmarkResult) -> tuple[Reference, ...]:
    sources = [result.joint.model, result.joint.truth, *(each.law for each in result.contenders)]
    references = {reference.key: reference for reference in (*cite(tuple(sources)), BONE2019)}
    for each in result.contenders:
        references |= {reference.key: reference for reference in (each.tuning.references if each.tuning else ())}
    return tuple(references.values())


def _settings(result: BenchmarkResult) -> tuple[tuple[str, str, str], ...]:
    joint = result.joint
    sensors = [(f"sensor of {sensor.column}", _sensor_text(sensor), "chosen") for sensor in joint.sensors]
    return (
        ("valves", joint.valve, "chosen"),
        ("mean pressure", f"{joint.mean_pressure / 1e5:g} bar", "chosen"),
        ("family of models", ", ".join(joint.family), "chosen"),
        ("objective of tuning", str(joint.objective), "chosen"),
        *sensors,
    )


def _sensor_text(sensor: object) -> str:
    fields = [f for f in dataclasses.fields(sensor) if f.name != "column"]  # type: ignore[arg-type]
    return ", ".join(f"{f.name} {getattr(sensor, f.name):.4g}" for f in fields if getattr(sensor, f.name))
