"""Closed-loop tracking in a report: set points and measurements, and the parameters of the controller."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...core.plotting import BLACK, BLUE, legend_below, new_figure
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.controller import relative_unit
from ...engine.loop.piecewise_linear import PiecewiseLinear
from ...recording import Recording
from ...recording.display_units import display_scale
from ...report.chapter import Plot, Table, TableColumn
from ...report.parameters import parameter_table
from .scenario import Scenario, run_column_units


def loop_plot(scenario: Scenario, loop: ControlLoop, recording: Recording) -> Plot:
    """Return the plot of the set points, with their steps, and of the controlled variables."""
    names = list(dict.fromkeys((*loop.controller.setpoints, *loop.controller.measured_columns)))
    units = run_column_units(scenario.problem)
    start, time = scenario.problem.start_time, recording["time"]
    end = float(time[-1]) if time[-1] > start else start + scenario.problem.duration
    setpoints = loop.setpoint.segments(loop.controller.setpoints, start, end - start)
    figure, axes = new_figure(len(names), 1, height=0.9 + 1.9 * len(names), sharex=True, squeeze=False)
    for name, axis in zip(names, axes[:, 0], strict=True):
        factor, display_unit = display_scale(name)
        unit = display_unit or units.get(name, "")
        if name in recording:
            axis.plot(time, recording[name] * factor, color=BLUE, label="measured")
        if name in loop.controller.setpoints:
            instants, values = segment_vertices(setpoints, start, loop.controller.setpoints.index(name))
            axis.plot(instants, values * factor, color=BLACK, linestyle="--", linewidth=0.9, label="set point")
        axis.set_ylabel(f"{name}\n[{unit}]" if unit else name)
    axes[-1, 0].set_xlabel("time [s]")
    figure.align_ylabels()
    legend_below(figure, axes[0, 0])
    return Plot("loop", f"Set points and measurements; sample time of the controller {loop.sample_time:g} s.", figure)


def segment_vertices(segments: PiecewiseLinear, start: float, i: int) -> tuple[Any, Any]:
    """Return times [s] and values at both ends of every segment, so that steps are drawn as vertical lines."""
    starts = segments.starts(start)
    first = segments.values[:, i]
    last = first + segments.slopes[:, i] * (segments.ends - starts)
    return np.column_stack([starts, segments.ends]).ravel(), np.column_stack([first, last]).ravel()


def controller_table(scenario: Scenario, loop: ControlLoop) -> Table:
    """Return the parameters of a controller, in the units that follow from its measurement and manipulated input."""
    units = run_column_units(scenario.problem)
    y, u = (units.get(names[0]) or "1" for names in (loop.controller.measured_columns, loop.controller.inputs))
    table = parameter_table(
        loop.controller, "controller", f"Parameters of the controller, {type(loop.controller).__name__}"
    )
    resolved = [relative_unit(str(unit), y, u) for unit in table.columns["unit"]]
    return dataclasses.replace(table, columns={**table.columns, "unit": TableColumn(resolved)})
