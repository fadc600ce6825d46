"""Report chapter of a tuning, with its figures."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, GREEN, LINES, ORANGE, RED, SKY, AirmuscleError, cite, leaves, legend_below, new_figure
from ...engine.loop.control_loop import SETPOINT, ControlLoop
from ...engine.run import Integrator, simulate
from ...recording import Recording
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from . import RuleSettings, Tuning
from .case import loop_with_gains

DISPLAY = {"Pa": (1e-5, "bar"), "m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}
"""Factor and unit in which the controlled column is displayed."""
COSTS = {"air": (1e3, "mean air drawn [g/s]"), "travel": (1.0, "mean travel [strokes/s]")}
"""Factor and axis label of the metrics that are compared with the error."""
MAX_BRIEF = 10
"""Rows of the brief view (chosen)."""


def convergence_figure(tuning: Tuning) -> Any:
    """The objective of every set of gains, and the smallest so far, over the number of simulated loops."""
    figure, axis = new_figure(height=3.0)
    history = tuning.history
    loops = np.arange(1, len(history) + 1) * len(tuning.cases)
    finite = np.isfinite(history.objective)
    axis.plot(loops[finite], history.objective[finite], "o", color=SKY, markersize=2.5, label="set of gains")
    axis.plot(loops, history.best_so_far, color=BLUE, label="smallest so far")
    if tuning.present_objective is not None and np.isfinite(tuning.present_objective):
        axis.axhline(tuning.present_objective, color=RED, linestyle="--", linewidth=1.0, label="present gains")
    axis.set(xlabel="simulated loops", ylabel="objective", yscale="log")
    _plain_numbers(axis)
    legend_below(figure, axis, columns=3)
    return figure


def pareto_figure(tuning: Tuning, unit: str) -> Any:
    """Mean index against mean air drawn and travel of the commands of all sets of gains, with the Pareto fronts."""
    history = tuning.history
    factor, shown = _display(unit)
    costs = [name for name in COSTS if np.isfinite(history.means(name)).any()]
    figure, axes = new_figure(1, len(costs), height=3.2, width=3.15 * max(len(costs), 1.4), squeeze=False)
    error = history.means("index") * factor
    for axis, name in zip(axes[0], costs, strict=True):
        scale, label = COSTS[name]
        cost, front = history.means(name) * scale, history.pareto(name)
        axis.plot(cost, error, "o", color=SKY, markersize=2.5, label="set of gains")
        axis.plot(cost[front], error[front], "o-", color=ORANGE, markersize=3, linewidth=1.0, label="Pareto front")
        if tuning.start:
            axis.plot(cost[0], error[0], "s", color=RED, markersize=6, label="present gains")
        axis.plot(cost[tuning.best], error[tuning.best], "D", color=BLUE, markersize=6, label="tuned gains")
        axis.set(xlabel=label, ylabel=f"mean index [{shown}]" if shown else "mean index", yscale="log")
        _plain_numbers(axis)
    legend_below(figure, axes[0, 0], columns=4)
    return figure


def response_figure(runs: Mapping[str, Recording], column: str, unit: str) -> Any:
    """The controlled column of the nominal case, with its set point, for several sets of gains."""
    factor, shown = _display(unit)
    figure, axis = new_figure(height=3.0)
    for run, colour, name in zip(runs.values(), (RED, BLUE, GREEN, *LINES), runs, strict=False):
        axis.plot(run["time"], run[column] * factor, color=colour, label=name)
    last = list(runs.values())[-1]
    wanted = last[f"{SETPOINT}{column}"] * factor
    axis.plot(
        last["time"], wanted, color=BLACK, linestyle="--", linewidth=0.9, drawstyle="steps-post", label="set point"
    )
    axis.set(xlabel="time [s]", ylabel=f"{column} [{shown}]" if shown else column)
    legend_below(figure, axis, columns=4)
    return figure


def _plain_numbers(axis: Any) -> None:
    """Numbers without powers on a logarithmic axis."""
    axis.yaxis.set_major_formatter("{x:g}")
    axis.yaxis.set_minor_formatter("{x:g}")


def _display(unit: str) -> tuple[float, str]:
    """Factor and unit in which a quantity that begins with an SI unit is displayed: Pa s in bar s."""
    first, _, rest = ("" if unit == "1" else unit).partition(" ")
    factor, shown = DISPLAY.get(first, (1.0, first))
    return factor, f"{shown} {rest}".strip()


def tuning_chapter(
    tuning: Tuning, title: str, units: Mapping[str, str], notes: Sequence[str] = (), rules: Sequence[RuleSettings] = (),
    integrator: Integrator | None = None,
) -> Chapter:  # fmt: skip
    """The chapter of a tuning: gains, cases, figures and settings.

    units  of the gains by path, and of the columns of the plant by name
    rules  settings of tuning rules that were among the starts
    """
    column, unit = next(iter(tuning.scales)), _error_unit(tuning, units)
    runs = _runs(tuning, integrator)
    caption = "Objective over the budget; a failed set of gains is not drawn."
    plots = [Plot("convergence", caption, partial(convergence_figure, tuning))]
    caption = "Mean tracking index over the cases against mean air drawn and travel of commands, with Pareto fronts."
    plots.append(Plot("pareto", caption, partial(pareto_figure, tuning, tuning.index.unit(unit))))
    if runs:
        caption = "Nominal case with present and tuned gains."
        plots.append(Plot("response", caption, partial(response_figure, runs, column, unit)))
    values = {
        "objective": tuning.objective, "objective with the present gains": tuning.present_objective,
        "simulated loops": tuning.simulated_loops, "sets of gains": len(tuning.history), "seed": tuning.seed,
        "interrupted": tuning.interrupted,
    }  # fmt: skip
    bound = [f"'{path}' is on a bound of its range; a wider range may give a smaller objective"
             for path in tuning.on_bound]  # fmt: skip
    return Chapter(
        "tuning", title, summary=_summary(tuning),
        values=tuple(NamedValue(name, value, brief=False) for name, value in values.items()),
        tables=(gain_table(tuning, units), case_table(tuning, units), *([rule_table(rules)] if rules else [])),
        plots=tuple(plots), notes=(*notes, *bound), references=(*tuning.references, *cite(tuple(rules))),
        chosen=_settings(tuning),
    )  # fmt: skip


def _runs(tuning: Tuning, integrator: Integrator | None) -> dict[str, Recording]:
    """Runs of the nominal case; one that fails is left out."""
    case, runs = tuning.cases[0], {}
    for name, gains in (("present gains", {}), ("tuned gains", tuning.gains)):
        loop: ControlLoop = loop_with_gains(case, gains)
        try:
            runs[name] = simulate(
                case.plant, loop, duration=tuning.duration, start_time=tuning.start_time, initial_state=case.start(),
                output_times=loop.sample_time, integrator=integrator,
            )  # fmt: skip
        except AirmuscleError:
            continue
    return runs


def _summary(tuning: Tuning) -> str:
    present = tuning.present_objective
    before = "" if present is None else f"; with the present gains it is {present:.4g}"
    parts = [
        f"{tuning.simulated_loops} loops were simulated: {len(tuning.history)} sets of gains in "
        f"{len(tuning.cases)} cases. The objective is {tuning.objective:.4g}{before}."
    ]
    failed = int(np.count_nonzero(~np.isfinite(tuning.history.objective)))
    if failed:
        parts.append(f"{failed} sets of gains failed in at least one case.")
    if tuning.interrupted:
        parts.append(f"The search was interrupted before its budget of {tuning.budget} loops was used.")
    return " ".join(parts)


def gain_table(tuning: Tuning, units: Mapping[str, str]) -> Table:
    """The gains before and after, with their ranges."""
    present = {leaf.path: leaf.value for leaf in leaves(tuning.cases[0].controller)}
    columns: dict[str, Any] = {
        "gain": [each.path for each in tuning.ranges],
        "minimum": TableColumn([each.low for each in tuning.ranges], BY_ROW),
        "maximum": TableColumn([each.high for each in tuning.ranges], BY_ROW),
        "present": TableColumn([present[each.path] for each in tuning.ranges], BY_ROW),
        "tuned": TableColumn([tuning.gains[each.path] for each in tuning.ranges], BY_ROW),
        "unit": [units.get(each.path, "") for each in tuning.ranges],
    }
    return Table("gains", "Gains", columns, brief=MAX_BRIEF)


def _error_unit(tuning: Tuning, units: Mapping[str, str]) -> str:
    """The unit of the tracking error [SI], that of its first column."""
    return "1" if tuning.index.scales else units.get(next(iter(tuning.scales))) or "1"


def case_table(tuning: Tuning, units: Mapping[str, str]) -> Table:
    """The metrics of every case with the present gains, if these were simulated, and with the tuned gains.

    units  of the columns of the plant by name
    """
    unit = tuning.index.unit(_error_unit(tuning, units))
    metrics, best = tuning.history.metrics, tuning.best
    columns: dict[str, Any] = {"case": [case.name for case in tuning.cases]}
    if tuning.start:
        columns["index, present gains"] = TableColumn(metrics.index[0], unit)
    columns["index, tuned gains"] = TableColumn(metrics.index[best], unit)
    columns["air drawn"] = TableColumn(metrics.air[best], "kg/s", "g/s")
    columns["travel"] = TableColumn(metrics.travel[best], "strokes/s")
    return Table("cases", "Cases", columns, f"Index: {type(tuning.index).__name__}.", brief=MAX_BRIEF)


def history_table(tuning: Tuning) -> Table:
    """Every set of gains with its objective and mean metrics [SI]."""
    history = tuning.history
    columns: dict[str, Any] = {"set": list(range(len(history)))}
    columns |= {path: history.gains[:, i] for i, path in enumerate(history.paths)}
    columns["objective"] = history.objective
    columns |= {f"mean {name}": history.means(name) for name in ("index", "air", "travel")}
    return Table("history", "Sets of gains", columns, series=True)


def rule_table(rules: Sequence[RuleSettings]) -> Table:
    """The settings of tuning rules."""
    columns: dict[str, Any] = {
        "rule": [each.rule for each in rules],
        "gain": [each.gain for each in rules],
        "integral time": TableColumn([each.integral_time for each in rules], "s"),
        "derivative time": TableColumn([each.derivative_time for each in rules], "s"),
        "set-point weight": [each.setpoint_weight for each in rules],
    }
    title = "Settings of tuning rules, among the starts"
    return Table("rules", title, columns, "The gain is in SI units.", brief=len(rules))


def _settings(tuning: Tuning) -> tuple[tuple[str, str, str], ...]:
    controller = tuning.cases[0].controller
    return (
        ("controller", type(controller).__name__, "scenario"),
        ("index", str(tuning.index), "chosen"),
        ("objective", str(tuning.criterion), "chosen"),
        ("optimiser", f"CMA-ES, seed {tuning.seed}, budget {tuning.budget} loops", "chosen"),
        ("duration of a run", f"{tuning.duration:g} s", "scenario"),
    )
