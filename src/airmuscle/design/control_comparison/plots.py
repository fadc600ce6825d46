"""Figures of a comparison of controllers: errors of tasks, runs, learning curves."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import BLACK, DASHES, LINES, MARKERS, Array, legend_below, new_figure
from . import ContenderResult, ControlTask, Group, LearningCurve, RunKey


def marker_style(number: int) -> dict[str, Any]:
    """Marker of a contender; beyond those of the shared style the markers are open, with the
    colours moved by one.
    """
    turn, place = divmod(number, len(MARKERS))
    colour = LINES[(place + turn) % len(LINES)]
    return {
        "marker": MARKERS[place],
        "color": colour,
        "markerfacecolor": "none" if turn else colour,
    }


def line_style(number: int) -> dict[str, Any]:
    """Line of a contender; beyond those of the shared style each colour has another dash
    pattern.
    """
    turn, place = divmod(number, len(LINES))
    return {
        "color": LINES[place],
        "linestyle": DASHES[(place + 3 * turn) % len(DASHES)],
        "linewidth": 1.0,
    }


def error_figure(names: Sequence[str], errors: Mapping[str, Array]) -> Any:
    """The rms error of every controller in every task (tasks, 3): median, smallest and largest."""
    figure, axis = new_figure(height=1.2 + 0.32 * len(names))
    rows = np.arange(len(names))
    middle = (len(errors) - 1) / 2
    for i, (contender, values) in enumerate(errors.items()):
        style = marker_style(i)
        shifted = rows + 0.08 * (i - middle)
        median, low, high = values.T
        axis.plot(median, shifted, linestyle="none", label=contender, **style)
        axis.hlines(shifted, low, high, color=style["color"], linewidth=0.7)
    axis.set(xscale="log", xlabel="rms error [degree]")
    axis.set_yticks(rows, names)
    axis.set_ylim(len(names) - 0.5, -0.5)
    axis.xaxis.set_major_formatter(_text_of_tick)
    axis.xaxis.set_minor_formatter(_text_of_tick)
    legend_below(figure, axis, columns=3)
    return figure


def _text_of_tick(value: float, _: object) -> str:
    """The text of a tick of a logarithmic axis, at 1, 2 and 5 of a decade alone: more would
    overlap.
    """
    digit = f"{value:.0e}"[0]
    return f"{value:g}" if digit in "125" else ""


def run_figure(
    results: Sequence[ContenderResult], tasks: Sequence[ControlTask], group: Group, truth: str
) -> Any:
    """Angle and error over time of some tasks on a truth, one column for each."""
    count = len(tasks)
    figure, axes = new_figure(
        2, count, width=2.4 * max(count, 2), height=4.4, squeeze=False, sharex="col"
    )
    for (upper, lower), task in zip(axes.T, tasks, strict=True):
        first = task.begin if task.event is None else min(task.begin, task.event)
        # a little before the event and what is judged
        limit = 0.0
        begin = max(0.0, first - 0.2)
        for i, result in enumerate(results):
            run = result.runs[RunKey(group, truth, task.name)]
            if run.recording is None or run.metrics is None:
                continue
            time = np.asarray(run.recording["time"])
            shown = time >= begin
            wanted = np.degrees(task.motion.at(time)[0])
            angle = np.degrees(np.asarray(run.recording["angle"]))
            upper.plot(time[shown], angle[shown], label=result.name, **line_style(i))
            lower.plot(time[shown], (wanted - angle)[shown], **line_style(i))
            limit = max(limit, run.metrics.rmse)
        time = np.linspace(begin, task.duration, 500)
        upper.plot(
            time, np.degrees(task.motion.at(time)[0]), color=BLACK, linewidth=0.7, label="set point"
        )
        upper.set_title(task.name)
        lower.set(xlabel="time [s]", ylim=(-2.5 * limit - 1e-3, 2.5 * limit + 1e-3))
    axes[0, 0].set_ylabel("angle [degree]")
    axes[1, 0].set_ylabel("error [degree]")
    legend_below(figure, axes[0, 0], columns=3)
    return figure


def learning_figure(curves: Sequence[LearningCurve]) -> Any:
    """The rms error of repeated trials."""
    figure, axis = new_figure(height=2.8)
    for i, curve in enumerate(curves):
        trials = np.arange(1, curve.errors.size + 1)
        label = f"{curve.contender}, {curve.task.name}"
        axis.semilogy(
            trials,
            curve.errors,
            marker=MARKERS[i % len(MARKERS)],
            color=LINES[i % len(LINES)],
            label=label,
        )
    axis.set(xlabel="trial", ylabel="rms error [degree]")
    legend_below(figure, axis)
    return figure
