"""Figures of a comparison of control loops: errors on all plants, and the nominal runs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import BLACK, Array, legend_below, new_figure
from ...engine.loop import COMMAND, SETPOINT
from ...recording import Recording, display_scale
from .plots import line_style, marker_style


def loop_error_figure(errors: Mapping[str, Mapping[str, Array]], columns: Sequence[str]) -> Any:
    """RMS error of each controller on each plant, one axis for each controlled column."""
    count = len(columns)
    width = 3.6 * max(count, 1.4)
    figure, axes = new_figure(1, count, width=width, height=3.2, squeeze=False)
    for place, column in enumerate(columns):
        axis = axes[0, place]
        _draw_column_errors(axis, column, errors[column])
    return figure


def _draw_column_errors(axis: Any, column: str, errors: Mapping[str, Array]) -> None:
    """The errors of one controlled column, a row for each controller."""
    factor, unit = display_scale(column)
    names = list(errors)
    for row, name in enumerate(names):
        _draw_errors(axis, row, factor * errors[name])
    axis.set_yticks(range(len(names)), names)
    axis.set_ylim(len(names) - 0.5, -0.5)
    axis.set_xscale("log")
    axis.set_xlabel(f"rms error of {column} [{unit or 'SI'}]")
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter("{x:g}")


def _draw_errors(axis: Any, row: int, errors: Array) -> None:
    """The errors of a controller on all plants (plants,), and their median."""
    completed = np.flatnonzero(np.isfinite(errors))
    if not completed.size:
        return
    style = marker_style(row)
    heights = row + 0.25 * _spaced(completed.astype(float), errors.size)
    axis.plot(errors[completed], heights, linestyle="none", **style)
    median = float(np.median(errors[completed]))
    axis.plot([median] * 2, [row - 0.4, row + 0.4], color=style["color"], linewidth=1.0)


def _spaced(places: Array, count: int) -> Array:
    """Heights of the marks of plants about that of their controller, within -1 and 1."""
    return np.zeros(places.size) if count < 2 else 2.0 * places / (count - 1) - 1.0


def loop_run_figure(runs: Mapping[str, Recording | None], columns: Sequence[str]) -> Any:
    """Controlled columns with their set points, and below them the first command of each loop."""
    count = len(columns)
    height = 2.5 + 1.9 * count
    figure, axes = new_figure(count + 1, 1, height=height, sharex=True, squeeze=False)
    completed = dict[str, Recording]()
    for name, record in runs.items():
        if record is not None:
            completed[name] = record
    for place, column in enumerate(columns):
        axis = axes[place, 0]
        _draw_column(axis, column, completed)
    _draw_commands(axes[count, 0], completed)
    legend_below(figure, axes[0, 0], columns=3)
    return figure


def _draw_commands(axis: Any, runs: Mapping[str, Recording]) -> None:
    """The first command of each run."""
    axis.set_xlabel("time [s]")
    for number, record in enumerate(runs.values()):
        command = next(key for key in record if key.startswith(COMMAND))
        style = line_style(number)
        axis.plot(record["time"], record[command], drawstyle="steps-post", **style)
        axis.set_ylabel(command.removeprefix(COMMAND))


def _draw_column(axis: Any, column: str, runs: Mapping[str, Recording]) -> None:
    """A controlled column of all runs with the set point of the last one."""
    factor, unit = display_scale(column)
    axis.set_ylabel(f"{column} [{unit}]" if unit else column)
    record: Recording | None = None
    for number, (name, record) in enumerate(runs.items()):
        style = line_style(number)
        axis.plot(record["time"], factor * record[column], label=name, **style)
    if record is None:
        return
    style = {"color": BLACK, "linewidth": 0.7, "drawstyle": "steps-post"}
    wanted = factor * record[f"{SETPOINT}{column}"]
    axis.plot(record["time"], wanted, label="set point", **style)
