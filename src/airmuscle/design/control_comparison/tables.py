"""Tables of a comparison of controllers: searches, gains, truths, all metrics, learning and failed
runs.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ...core import conversion
from ...report.chapter import Table, TableColumn
from . import ContenderResult, JointRig, LearningCurve
from .commissioning import RESTARTS, SEARCH_SPREAD
from .signals import METRICS, RATED_STROKES, SETTLING_BAND, STEADY_TIME

ANR = " (ANR)"
"""End of the unit of a volume of air at the reference atmosphere of ISO 8778."""


class SearchRow(NamedTuple):
    """A contender in the table of the searches; `spread` is None for one search alone."""

    gains: int
    sets: int
    converged: str
    restarts: int
    objective: float
    spread: float | None


def metric_column(metric: str, values: Sequence[float], **declared: Any) -> TableColumn:
    """The column of a metric."""
    _, unit, shown = METRICS[metric]
    factor = (
        1.0 if unit == shown else conversion(shown.removesuffix(ANR), unit.removesuffix(ANR)).factor
    )
    return TableColumn([factor * value for value in values], unit, shown, **declared)


def search_table(joint: JointRig, results: Sequence[ContenderResult]) -> Table | None:
    """The searches for the models: sets of gains, agreement of their descents, objective and its
    spread.
    """
    tuned = [
        result
        for result in results
        if result.tuning is not None and result.contender.tuned_as is None
    ]
    names = list(dict.fromkeys(result.name for result in tuned))
    if not names:
        return None
    seeds = ", ".join(dict.fromkeys(str(result.seed) for result in results))

    rows = [_search_row([result for result in tuned if result.name == name]) for name in names]
    columns: dict[str, Any] = {
        "controller": names,
        "gains": [row.gains for row in rows],
        "sets of gains": [row.sets for row in rows],
        "converged": [row.converged for row in rows],
        "restarts": [row.restarts for row in rows],
        "objective": metric_column("rmse", [row.objective for row in rows]),
        "spread": TableColumn([row.spread for row in rows], "1", "%"),
    }
    return Table(
        "searches",
        "Searches",
        columns,
        f"For {len(joint.family)} models, none of which is a truth; seeds {seeds}. Objective:"
        f" {joint.objective}, median over the seeds; spread: largest over smallest. A search has"
        " converged where its two best descents agree. Where two seeds differ by more than"
        f" {100 * SEARCH_SPREAD:g} %, the worst one is restarted, at most {RESTARTS} times.",
    )


def _search_row(results: Sequence[ContenderResult]) -> SearchRow:
    """The row of the searches of a contender, one result for each seed."""
    tunings = [result.tuning for result in results if result.tuning]
    objectives = [tuning.objective for tuning in tunings]
    converged = sum(tuning.converged for tuning in tunings)
    spread = max(objectives) / min(objectives) - 1.0 if len(objectives) > 1 else None
    return SearchRow(
        gains=len(tunings[0].ranges),
        sets=max(len(tuning.history) for tuning in tunings),
        converged=f"{converged} of {len(tunings)}",
        restarts=sum(result.restarts for result in results),
        objective=sorted(objectives)[len(objectives) // 2],
        spread=spread,
    )


def gains_table(results: Sequence[ContenderResult]) -> Table | None:
    """The gains of the searches and of the commissionings, in SI units."""
    rows = [
        (
            result.name,
            result.seed,
            "models",
            path,
            value,
            "on a bound" if path in result.tuning.on_bound else "",
        )
        for result in results
        if result.tuning is not None
        for path, value in result.tuning.gains.items()
    ]
    rows += [
        (result.name, result.seed, truth, path, value, f"{commissioning.runs} runs")
        for result in results
        for truth, commissioning in result.commissionings.items()
        for path, value in commissioning.gains.items()
    ]
    names = ("controller", "seed", "found on", "gain", "value [SI]", "remark")
    return _rows("gains", "Gains", names, rows, shown=False)


def truth_table(joint: JointRig) -> Table:
    """The truths."""
    truths = joint.truths
    columns: dict[str, Any] = {"truth": [truth.name for truth in truths]}
    for heading in dict.fromkeys(key for truth in truths for key in truth.description):
        columns[heading] = [truth.description.get(heading, "–") for truth in truths]
    columns["unknown dead time"] = [
        f"{1e3 * truth.extra_delay * joint.sample_time:g} ms" for truth in truths
    ]
    return Table("truths", "Truths", columns, joint.truths_note)


def metrics_table(results: Sequence[ContenderResult]) -> Table:
    """All metrics, one row for each run."""
    keys = [(result, key) for result in results for key in result.runs]
    columns: dict[str, Any] = {
        "controller": [result.name for result, _ in keys],
        "seed": [result.seed for result, _ in keys],
        "group": [str(key.group) for _, key in keys],
        "truth": [key.truth for _, key in keys],
        "task": [key.task for _, key in keys],
    }
    metrics = [result.runs[key].metrics for result, key in keys]
    for field, (title, _, _) in METRICS.items():
        columns[title] = metric_column(
            field, [math.nan if m is None else float(getattr(m, field)) for m in metrics]
        )
    return Table(
        "metrics",
        "All metrics",
        columns,
        f"Settling: until the error remains within {SETTLING_BAND:g} degrees. Steady-state error:"
        f" mean of the last {STEADY_TIME:g} s. Valve life: of the busiest valve at"
        f" {RATED_STROKES:g} openings (chosen). Stiffness error: of the true stiffness of the"
        " muscles against that wanted.",
        shown=False,
    )


def learning_table(curves: Sequence[LearningCurve]) -> Table:
    """The rms errors of repeated trials."""
    columns: dict[str, Any] = {"trial": list(range(1, max(c.errors.size for c in curves) + 1))}
    columns |= {
        f"{curve.contender}, {curve.task.name}": metric_column("rmse", curve.errors.tolist())
        for curve in curves
    }
    return Table(
        "learning",
        "Iterative learning",
        columns,
        "rms error of each trial; the first is without learning.",
    )


def failure_table(results: Sequence[ContenderResult]) -> Table | None:
    """The runs that ended early, with their reasons; None if there are none."""
    rows = [
        (result.name, result.seed, *key, run.reason)
        for result in results
        for key, run in result.runs.items()
        if run.metrics is None
    ]
    return _rows(
        "failed",
        "Runs that ended early",
        ("controller", "seed", "group", "truth", "task", "reason"),
        rows,
    )


def _rows(
    key: str,
    title: str,
    names: Sequence[str],
    rows: Sequence[tuple[object, ...]],
    shown: bool = True,
) -> Table | None:
    """A table of rows; None if there are none."""
    columns = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    return Table(key, title, columns, shown=shown) if rows else None


def settings_of(joint: JointRig) -> tuple[tuple[str, str, str], ...]:
    """The settings of the joint."""
    sensors = list[tuple[str, str, str]]()
    for sensor in joint.sensors:
        known = {
            f.name: getattr(sensor, f.name)
            for f in dataclasses.fields(sensor)
            if f.name != "column"
        }
        text = ", ".join(f"{name} {value:.4g}" for name, value in known.items() if value)
        sensors.append((f"sensor of {sensor.column}", text, "chosen"))
    return (
        ("valves", joint.valve, "chosen"),
        ("mean pressure", f"{joint.mean_pressure / 1e5:g} bar", "chosen"),
        ("family of models", ", ".join(joint.family), "chosen"),
        ("objective of tuning", str(joint.objective), "chosen"),
        *sensors,
    )
