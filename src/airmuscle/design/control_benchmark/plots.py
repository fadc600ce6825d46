"""Figures of the control benchmark: errors of all tasks, runs of some tasks, learning curves."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import BLACK, DASHES, LINES, MARKERS, legend_below, new_figure
from ...report.chapter import Plot
from . import BenchmarkResult, Group, LearningCurve, RunKey

MAX_PANELS = 4
DRAWN = ("step", "sine 2 Hz", "minimum jerk", "load change", "torque disturbance", "sine 1 Hz", "valve stuck", "hold")
"""Tasks that are drawn over time, the first four that the benchmark contains."""


def benchmark_plots(result: BenchmarkResult, curves: Sequence[LearningCurve] = ()) -> tuple[Plot, ...]:
    """All figures of a benchmark; the runs are those of the group with more knowledge."""
    groups = result.groups
    names = [task.name for task in result.tasks]
    drawn = [name for name in (*DRAWN, *names) if name in names]
    plots = [error_plot(result, group) for group in groups]
    plots += [run_plot(result, list(dict.fromkeys(drawn))[:MAX_PANELS], groups[-1])]
    return (*plots, *([learning_plot(curves)] if curves else []))


def marker_style(number: int) -> dict[str, Any]:
    """Marker of a contender; beyond those of the shared style the markers are open, with the colours moved by one."""
    turn, place = divmod(number, len(MARKERS))
    colour = LINES[(place + turn) % len(LINES)]
    return {"marker": MARKERS[place], "color": colour, "markerfacecolor": "none" if turn else colour}


def line_style(number: int) -> dict[str, Any]:
    """Line of a contender; beyond those of the shared style each colour has another dash pattern."""
    turn, place = divmod(number, len(LINES))
    return {"color": LINES[place], "linestyle": DASHES[(place + 3 * turn) % len(DASHES)], "linewidth": 1.0}


def error_plot(result: BenchmarkResult, group: Group = Group.MODELS) -> Plot:
    """The rms error of every controller of a group in every task: median and range over searches and truths."""
    names, contenders = [task.name for task in result.tasks], result.contenders(group)
    figure, axis = new_figure(height=1.2 + 0.32 * len(names))
    rows = np.arange(len(names))
    for i, contender in enumerate(contenders):
        found = np.array([result.metric(contender, name, "rmse", group) for name in names])
        style, shift = marker_style(i), 0.08 * (i - (len(contenders) - 1) / 2)
        axis.plot(found[:, 0], rows + shift, linestyle="none", label=contender, **style)
        axis.hlines(rows + shift, found[:, 1], found[:, 2], color=style["color"], linewidth=0.7)
    axis.set(xscale="log", xlabel="rms error [degree]")
    axis.set_yticks(rows, names)
    axis.set_ylim(len(names) - 0.5, -0.5)
    for which in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
        which(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "125" else "")
    legend_below(figure, axis, columns=3)
    caption = (
        f"Error in each task with {result.joint.name}, {group}: median and range over {result.extent}; "
        f"{result.joint.valve}."
    )
    return Plot(f"errors_{group.name.lower()}", caption, figure)


def run_plot(result: BenchmarkResult, names: Sequence[str], group: Group = Group.MODELS) -> Plot:
    """Angle and error over time of some tasks on the first truth, one column for each."""
    count, truth, contenders = len(names), result.truths[0], result.contenders(group)
    shown = [next(each for each in result.results if each.name == name) for name in contenders]
    figure, axes = new_figure(2, count, width=2.4 * max(count, 2), height=4.4, squeeze=False, sharex="col")
    for column, name in enumerate(names):
        upper, lower = axes[:, column]
        task = next(task for task in result.tasks if task.name == name)
        first = task.begin if task.event is None else min(task.begin, task.event)
        limit, begin = 0.0, max(0.0, first - 0.2)  # a little before the event and what is judged
        for i, each in enumerate(shown):
            run = each.runs[RunKey(group, truth, name)]
            if run.recording is None or run.metrics is None:
                continue
            time = np.asarray(run.recording["time"])
            kept, wanted = time >= begin, np.degrees(task.motion.at(time)[0])
            angle = np.degrees(np.asarray(run.recording["angle"]))
            upper.plot(time[kept], angle[kept], label=each.name, **line_style(i))
            lower.plot(time[kept], (wanted - angle)[kept], **line_style(i))
            limit = max(limit, run.metrics.rmse)
        time = np.linspace(begin, task.duration, 500)
        upper.plot(time, np.degrees(task.motion.at(time)[0]), color=BLACK, linewidth=0.7, label="set point")
        upper.set_title(name)
        lower.set(xlabel="time [s]", ylim=(-2.5 * limit - 1e-3, 2.5 * limit + 1e-3))
    axes[0, 0].set_ylabel("angle [degree]")
    axes[1, 0].set_ylabel("error [degree]")
    legend_below(figure, axes[0, 0], columns=3)
    return Plot("runs", f"Angle and error over time, {group}, {truth}, first search.", figure)


def learning_plot(curves: Sequence[LearningCurve]) -> Plot:
    """The rms error of repeated trials."""
    figure, axis = new_figure(height=2.8)
    for i, curve in enumerate(curves):
        trials = np.arange(1, curve.errors.size + 1)
        label = f"{curve.contender}, {curve.task.name}"
        axis.semilogy(trials, curve.errors, marker=MARKERS[i % len(MARKERS)], color=LINES[i % len(LINES)], label=label)
    axis.set(xlabel="trial", ylabel="rms error [degree]")
    legend_below(figure, axis)
    return Plot("learning", "Iterative learning: rms error of repeated trials on a truth.", figure)
