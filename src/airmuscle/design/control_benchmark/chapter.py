"""Report chapter of the control benchmark: rankings of both groups, errors, searches, truths, figures."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import cite, conversion, counted
from ...report.chapter import Chapter, NamedValue, Table, TableColumn
from .benchmark import REST_LIFE, REST_TASK, BenchmarkResult, Group
from .commissioning import RESTARTS, SEARCH_SPREAD
from .learning import LearningCurve
from .plots import benchmark_plots
from .signals import BONE2019, METRICS, RATED_STROKES, SETTLING_BAND, STEADY_TIME

ANR = " (ANR)"
"""End of the unit of a volume of air at the reference atmosphere of ISO 8778."""
MAX_BRIEF, SHORT_CONTROLLERS = 16, 4
"""Tasks and controllers of the table of errors in the brief view (chosen)."""


def _column(metric: str, values: Sequence[float], **declared: Any) -> TableColumn:
    """The column of a metric."""
    _, unit, shown = METRICS[metric]
    factor = 1.0 if unit == shown else conversion(shown.removesuffix(ANR), unit.removesuffix(ANR)).factor
    return TableColumn([factor * value for value in values], unit, shown, **declared)


def benchmark_chapter(result: BenchmarkResult, curves: Sequence[LearningCurve] = ()) -> Chapter:
    """The chapter of a benchmark: for each group ranking and errors, then searches, gains, truths and all metrics."""
    joint, tables = result.joint, list[Table]()
    for group in result.groups:
        is_ordered = len(result.contenders(group)) > 1 and len(result.truths) > 1
        tables += [ranking_table(result, group), *([order_table(result, group)] if is_ordered else [])]
        tables.append(error_table(result, "rmse", group))
    further = search_table(result), gains_table(result), truth_table(result), metrics_table(result)
    last = learning_table(curves) if curves else None, failure_table(result)
    tables += [table for table in (*further, *last) if table is not None]
    learned = [f"learning: {each.errors[0]:.3g} degrees in trial 1, {each.errors[-1]:.3g} in trial {each.errors.size}"
               for each in curves]  # fmt: skip
    sources = cite((joint.model, *(truth.plant for truth in joint.truths), *(each.law for each in result.results)))
    tuned = [reference for each in result.results if each.tuning for reference in each.tuning.references]
    return Chapter(
        "benchmark", f"Control of an antagonistic joint with {joint.name}", summary=tuple(_summary(result)),
        values=(NamedValue("seeds", ", ".join(map(str, result.seeds)), brief=False),), tables=tuple(tables),
        plots=benchmark_plots(result, curves), notes=tuple(learned),
        references=tuple({reference.key: reference for reference in (*sources, BONE2019, *tuned)}.values()),
        chosen=_settings(result),
    )  # fmt: skip


def ranking_table(result: BenchmarkResult, group: Group) -> Table:
    """The contenders of a group by score, with what they cost."""
    scores, tasks = result.scores(group), [task.name for task in result.tasks]
    air = [[result.metric(name, task, "air", group).median for task in tasks] for name in scores]
    errors = [[result.values(name, task, "rmse", group) for task in tasks] for name in scores]
    strokes, life = (
        [result.metric(name, REST_TASK, metric, group).median if REST_TASK in tasks else math.nan for name in scores]
        for metric in ("strokes", "valve_life")
    )
    return Table(
        f"ranking_{group.name.lower()}",
        f"Ranking, {group}",
        {
            "controller": list(scores),
            "score": [each.median for each in scores.values()],
            "lowest": [each.low for each in scores.values()],
            "highest": [each.high for each in scores.values()],
            "air, mean": _column("air", [sum(each) / len(each) for each in air]),
            "strokes at rest": _column("strokes", strokes),
            "valve life at rest": _column("valve_life", life, short="life at rest"),
            "runs completed": TableColumn([float(np.isfinite(e).mean()) for e in errors], "1", "%", brief=False),
        },
        "Score: geometric mean over the tasks of the rms error, divided by the smallest of the group on the same "
        f"truth, times {REST_LIFE:g} h over the life of the busiest valve in the task '{REST_TASK}' where it is "
        f"shorter; 1 is the best in every task. Over {result.extent}.",
        brief=len(scores),
    )  # fmt: skip


def order_table(result: BenchmarkResult, group: Group) -> Table:
    """On how many truths one contender is better than another one in every search."""
    ratios = result.ratios(group)
    names = list(result.scores(group))
    rows = {a: [int((ratios[a].max(axis=0) < ratios[b].min(axis=0)).sum()) for b in names] for a in names}
    columns: dict[str, Any] = {"better": names}
    columns |= {f"than {b}": [rows[a][j] if a != b else None for a in names] for j, b in enumerate(names)}
    return Table(
        f"order_{group.name.lower()}", f"Order, {group}", columns,
        f"Number of truths, of {len(result.truths)}, on which every search of a controller has a smaller score than "
        "every search of another one.",
    )  # fmt: skip


def error_table(result: BenchmarkResult, metric: str, group: Group) -> Table:
    """The median of one metric of all contenders of a group, one row for each task."""
    columns: dict[str, Any] = {"task": [task.name for task in result.tasks]}
    for i, name in enumerate(result.contenders(group)):
        values = [result.metric(name, task.name, metric, group).median for task in result.tasks]
        columns[name] = _column(metric, values, brief=i < SHORT_CONTROLLERS)
    name = METRICS[metric][0]
    title = f"RMS{name[3:]}" if name.startswith("rms") else name.capitalize()
    return Table(
        f"{metric}_{group.name.lower()}", f"{title}, {group}", columns,
        f"Median over searches and truths, from the beginning of the judged time of each task. Over {result.extent}.",
        brief=MAX_BRIEF,
    )  # fmt: skip


def search_table(result: BenchmarkResult) -> Table | None:
    """The searches for the models: sets of gains, agreement of their descents, objective and its spread."""
    tuned = [each for each in result.results if each.tuning is not None and each.contender.tuned_as is None]
    names = list(dict.fromkeys(each.name for each in tuned))
    if not names:
        return None
    searches = {name: [each.tuning for each in tuned if each.name == name and each.tuning] for name in names}
    best = {name: [tuning.objective for tuning in found] for name, found in searches.items()}
    columns: dict[str, Any] = {
        "controller": names,
        "gains": [len(found[0].ranges) for found in searches.values()],
        "sets of gains": [max(len(each.history) for each in found) for found in searches.values()],
        "converged": [f"{sum(each.converged for each in found)} of {len(found)}" for found in searches.values()],
        "restarts": [sum(each.restarts for each in tuned if each.name == name) for name in names],
        "objective": _column("rmse", [sorted(values)[len(values) // 2] for values in best.values()]),
        "spread": TableColumn([max(v) / min(v) - 1.0 if v[1:] else None for v in best.values()], "1", "%"),
    }
    return Table(
        "searches", "Searches", columns,
        f"For {len(result.joint.family)} models, none of which is a truth; seeds {', '.join(map(str, result.seeds))}. "
        f"Objective: {result.joint.objective}, median over the seeds; spread: largest over smallest. A search has "
        f"converged where its two best descents agree. Where two seeds differ by more than {100 * SEARCH_SPREAD:g} %, "
        f"the worst one is restarted, at most {RESTARTS} times.",
    )  # fmt: skip


def gains_table(result: BenchmarkResult) -> Table | None:
    """The gains of the searches and of the commissionings, in SI units."""
    rows = [
        (each.name, each.seed, "models", path, value, "on a bound" if path in each.tuning.on_bound else "")
        for each in result.results
        if each.tuning is not None
        for path, value in each.tuning.gains.items()
    ]
    rows += [
        (each.name, each.seed, truth, path, value, f"{found.runs} runs")
        for each in result.results
        for truth, found in each.commissionings.items()
        for path, value in found.gains.items()
    ]
    return _rows(
        "gains", "Gains", ("controller", "seed", "found on", "gain", "value [SI]", "remark"), rows, shown=False
    )


def truth_table(result: BenchmarkResult) -> Table:
    """The truths."""
    truths = result.joint.truths
    columns: dict[str, Any] = {"truth": [truth.name for truth in truths]}
    described = [result.joint.describe(truth) for truth in truths]
    columns |= {key: [each[key] for each in described] for key in described[0]}
    return Table("truths", "Truths", columns, "Flow, inertia, weight and offset relative to the model.")


def metrics_table(result: BenchmarkResult) -> Table:
    """All metrics, one row for each run."""
    keys = [(each, key) for each in result.results for key in each.runs]
    columns: dict[str, Any] = {
        "controller": [each.name for each, _ in keys],
        "seed": [each.seed for each, _ in keys],
        "group": [str(key.group) for _, key in keys],
        "truth": [key.truth for _, key in keys],
        "task": [key.task for _, key in keys],
    }
    found = [each.runs[key].metrics for each, key in keys]
    for field, (title, _, _) in METRICS.items():
        columns[title] = _column(field, [math.nan if m is None else float(getattr(m, field)) for m in found])
    return Table(
        "metrics", "All metrics", columns,
        f"Settling: until the error remains within {SETTLING_BAND:g} degrees. Steady-state error: mean of the last "
        f"{STEADY_TIME:g} s. Valve life: of the busiest valve at {RATED_STROKES:g} openings (chosen). Stiffness error: "
        "of the true stiffness of the muscles against that wanted.",
        shown=False,
    )  # fmt: skip


def learning_table(curves: Sequence[LearningCurve]) -> Table:
    """The rms errors of repeated trials."""
    columns: dict[str, Any] = {"trial": list(range(1, max(c.errors.size for c in curves) + 1))}
    columns |= {f"{each.contender}, {each.task.name}": _column("rmse", each.errors.tolist()) for each in curves}
    return Table("learning", "Iterative learning", columns, "rms error of each trial; the first is without learning.")


def failure_table(result: BenchmarkResult) -> Table | None:
    """The runs that ended early, with their reasons; None if there are none."""
    rows = [
        (each.name, each.seed, *key, run.reason)
        for each in result.results
        for key, run in each.runs.items()
        if run.metrics is None
    ]
    return _rows("failed", "Runs that ended early", ("controller", "seed", "group", "truth", "task", "reason"), rows)


def _rows(
    key: str, title: str, names: Sequence[str], rows: Sequence[tuple[object, ...]], shown: bool = True
) -> Table | None:
    """A table of rows; None if there are none."""
    columns = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    return Table(key, title, columns, shown=shown) if rows else None


def _summary(result: BenchmarkResult) -> list[str]:
    joint = result.joint
    number = len({each.name for each in result.results})
    best = (f"Smallest score, {group}: {next(iter(result.scores(group)))}." for group in result.groups)
    return [
        f"{counted(number, 'controller')}, {counted(len(result.tasks), 'task')}, "
        f"{counted(len(joint.truths), 'truth')}. {' '.join(best)} Valves: {joint.valve}. Sampled every "
        f"{joint.sample_time * 1e3:g} ms.",
        "Every controller is tuned by the same optimiser, with at most the same number of sets of gains for each "
        "gain, for perturbed models. In the group 'commissioned' it has then as many runs on the truth as every other "
        "one. The truths are drawn at random from a family that has no characteristic, friction law, valve or gas of "
        "the models. The measurements have the resolution of a 12-bit encoder, noise and dead time, of which a part "
        "is unknown.",
    ]


def _settings(result: BenchmarkResult) -> tuple[tuple[str, str, str], ...]:
    joint, sensors = result.joint, list[tuple[str, str, str]]()
    for sensor in joint.sensors:
        known = {f.name: getattr(sensor, f.name) for f in dataclasses.fields(sensor) if f.name != "column"}
        text = ", ".join(f"{name} {value:.4g}" for name, value in known.items() if value)
        sensors.append((f"sensor of {sensor.column}", text, "chosen"))
    return (
        ("valves", joint.valve, "chosen"),
        ("mean pressure", f"{joint.mean_pressure / 1e5:g} bar", "chosen"),
        ("family of models", ", ".join(joint.family), "chosen"),
        ("objective of tuning", str(joint.objective), "chosen"),
        *sensors,
    )
