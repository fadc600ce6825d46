"""Figures of a tuning: objective over the budget, Pareto fronts, and the runs with present and tuned gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.plotting import BLACK, BLUE, GREEN, LINES, ORANGE, RED, SKY, legend_below, new_figure
from ...engine.loop.control_loop import SETPOINT
from ...recording import Recording
from .result import Tuning

DISPLAY = {"Pa": (1e-5, "bar"), "m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}
"""Factor and unit in which the controlled column is displayed."""
COSTS = {"air": (1e3, "mean air drawn [g/s]"), "travel": (1.0, "mean travel [strokes/s]")}
"""Factor and axis label of the metrics that are compared with the error."""


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
    shown_metrics = [name for name in COSTS if np.isfinite(history.means(name)).any()]
    figure, axes = new_figure(
        1, len(shown_metrics), height=3.2, width=3.15 * max(len(shown_metrics), 1.4), squeeze=False
    )
    error = history.means("index") * factor
    for axis, name in zip(axes[0], shown_metrics, strict=True):
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
