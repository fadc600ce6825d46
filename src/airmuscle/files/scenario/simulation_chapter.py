"""Report chapter: a simulated run with its time series, inputs, parameters, and the tracking of set
points.
"""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, cite, legend_below, new_figure
from ...engine.loop import (
    InputSignal,
    Periodic,
    PiecewiseLinear,
    SampledSignal,
    Schedule,
    WithDrivers,
    relative_unit,
)
from ...engine.loop.control_loop import COMMAND, MEASURED, SETPOINT, ControlLoop
from ...recording import Recording
from ...recording.columns import display_scale, quantity_of
from ...report.chapter import BY_ROW, Chapter, Plot, Table, TableColumn
from ...report.formatting import format_number, typographic
from ...report.parameter_tables import parameter_table
from .scenario import Scenario, run_column_units

PLOTTED = (
    "pressure",
    "contraction",
    "force",
    "friction",
    "position",
    "angle",
    "speed",
    "angular_speed",
)
"""Quantities plotted, in this order; the recording contains all."""
MAX_BRIEF = 16
"""Columns of the brief view (chosen)."""
MAX_DRIVER_SEGMENTS = 300
"""Segments of an input with drivers that a figure resolves; of a longer input only the beginning is
plotted.
"""
MAX_SEGMENTS = 50_000
"""Segments plotted without drivers: there are no pulses to resolve."""
MAX_LISTED_CHANGES = 6
"""Maximum number of changes of an input that are listed one by one."""


def run_chapter(scenario: Scenario, recording: Recording) -> Chapter:
    """Return the chapter of a run, complete or up to its early end."""
    problem = scenario.problem
    reached = float(recording["time"][-1])
    loop = problem.input if isinstance(problem.input, ControlLoop) else None
    early = (
        f", ended early at {reached:.4g} s; the last note gives the reason"
        if reached < problem.end_time
        else ""
    )
    of_plant = [name for name in recording if not name.startswith((SETPOINT, MEASURED, COMMAND))]
    columns = [
        name for quantity in PLOTTED for name in of_plant if name.rpartition(".")[2] == quantity
    ]
    plots = [
        Plot("run", f"{scenario.title}: simulated time series.", partial(recording.plot, *columns))
    ]
    if loop is not None:
        plots.insert(0, loop_plot(scenario, loop, recording))
    if scenario.plant.inputs:
        plots.append(_input_plot(scenario, recording))
    start = ", ".join(
        f"{name} {typographic(format_number(value))}"
        for name, value in scenario.initial_state.items()
    )
    origins = {
        key: "scenario" for key in ("integrator", "initial_state") if key not in scenario.defaults
    }
    tables = [_range_table(scenario, recording)]
    tables.append(parameter_table(scenario.plant, "parameters", "Parameters of the plant"))
    tables += [controller_table(scenario, loop)] if loop else []
    chosen = (
        ("integrator", str(problem.integrator), origins.get("integrator", "default")),
        (
            "initial state (SI)",
            start,
            origins.get("initial_state", "default: equilibrium at ambient pressure"),
        ),
        ("inputs", describe_input(problem.input), "scenario"),
    )
    summary = (
        f"Simulation of {problem.duration:g} s{early}. {len(recording)} rows; recording.csv has all"
        " columns."
    )
    return Chapter(
        "simulation",
        scenario.title,
        summary,
        plots=tuple(plots),
        tables=tuple(tables),
        notes=recording.notes,
        references=tuple(cite((scenario.plant, loop))),
        chosen=chosen,
    )


def _range_table(scenario: Scenario, recording: Recording) -> Table:
    """Return the minimum, maximum and last value of each column, in the unit in which it is
    displayed.
    """
    names = list(recording)
    declared = run_column_units(scenario.problem)
    scales = []
    for name in names:
        quantity = quantity_of(name)
        declared_unit = declared.get(name)
        factor, unit = display_scale(name)
        is_usual = quantity is not None and declared_unit in (
            None,
            quantity.unit,
        )  # a unit that a model declares stays
        scales.append((factor, unit.removesuffix("-")) if is_usual else (1.0, declared_unit or ""))
    values = [factor * recording[name] for name, (factor, _) in zip(names, scales, strict=True)]
    columns: dict[str, Any] = {
        "column": names,
        "min": TableColumn([float(column.min()) for column in values], BY_ROW),
        "max": TableColumn([float(column.max()) for column in values], BY_ROW),
        "last": TableColumn([float(column[-1]) for column in values], BY_ROW),
        "unit": [unit for _, unit in scales],
    }
    return Table("ranges", "Columns", columns, brief=MAX_BRIEF)


def _input_plot(scenario: Scenario, recording: Recording) -> Plot:
    """Return the plot of the inputs that act on the plant, with their steps, and of the commands of
    drivers.
    """
    command = scenario.problem.input
    inputs = scenario.plant.inputs
    if isinstance(command, ControlLoop):
        command = command.as_open_loop(recording)
    units = {
        item.name: "" if item.unit == "1" else f"\n[{item.unit}]"
        for item in scenario.plant.input_variables
    }
    start = scenario.problem.start_time
    reached = float(recording["time"][-1])
    end = reached if reached > start else start + scenario.problem.duration
    applied = command.segments(inputs, start, end - start)
    shortened = applied.ends.size > (
        MAX_DRIVER_SEGMENTS if isinstance(command, WithDrivers) else MAX_SEGMENTS
    )
    if shortened:
        applied = command.segments(
            inputs, start, float(applied.ends[MAX_DRIVER_SEGMENTS - 1]) - start
        )
    plotted = float(applied.ends[-1]) - start
    commanded = (
        command.inner.segments(inputs, start, plotted) if isinstance(command, WithDrivers) else None
    )
    figure, axes = new_figure(
        len(inputs),
        1,
        height=0.9 + 0.9 * len(inputs),
        sharex=True,
        sharey=len(set(units.values())) == 1,
        squeeze=False,
    )  # one scale for inputs of the same unit: openings are compared
    for i, (name, axis) in enumerate(zip(inputs, axes[:, 0], strict=True)):
        if commanded is not None:
            vertices = segment_vertices(commanded, start, i)
            axis.plot(*vertices, color=BLACK, linestyle="--", linewidth=0.9, label="command")
        axis.plot(*segment_vertices(applied, start, i), color=BLUE, label="applied input")
        axis.set_ylabel(f"{name}{units[name]}")
    axes[-1, 0].set_xlabel("time [s]")
    figure.align_ylabels()
    if commanded is not None:
        legend_below(figure, axes[0, 0])
    part = f" (first {MAX_DRIVER_SEGMENTS} segments)" if shortened else ""
    legend = "; dashed: commands to the drivers" if commanded is not None else ""
    return Plot("inputs", f"Inputs applied to the plant{part}{legend}.", figure)


def describe_input(command: InputSignal | ControlLoop) -> str:
    """Return an input signal or control loop as one sentence; long tables are summarised."""
    if isinstance(command, ControlLoop):
        controller = command.controller
        name = type(controller).__name__
        inputs = ", ".join(controller.inputs)
        other_inputs = command.driven_inputs if command.drivers else command.other_inputs
        return (
            f"{name}, sample time {command.sample_time:g} s, manipulated inputs {inputs}; set"
            f" point: {describe_input(command.setpoint)}; other inputs:"
            f" {describe_input(other_inputs)}"
        )
    if isinstance(command, WithDrivers):
        chains = (f"{name}: {', '.join(map(str, chain))}" for name, chain in command.chains.items())
        return f"{describe_input(command.inner)}; drivers: {'; '.join(chains)}"
    if isinstance(command, Periodic):
        return f"periodic, {command.period:g} s: {describe_input(command.inner)}"
    if isinstance(command, Schedule):
        started = (
            (name, rows, f"0 before {rows[0][0]:g} s, " if rows and rows[0][0] > 0.0 else "")
            for name, rows in command.changes.items()
        )
        return (
            "; ".join(
                _describe_changes(name, rows, "from", before) for name, rows, before in started
            )
            or "none"
        )
    if isinstance(command, SampledSignal):
        return (
            "; ".join(_describe_changes(name, rows, "at") for name, rows in command.points.items())
            or "none"
        )
    return str(command)


def _describe_changes(
    name: str, rows: Sequence[tuple[float, float]], preposition: str, before: str = ""
) -> str:
    if len(rows) > MAX_LISTED_CHANGES:
        values = [value for _, value in rows]
        return (
            f"{name}: {before}{len(rows)} values between {min(values):g} and {max(values):g}, "
            f"{rows[0][0]:g} to {rows[-1][0]:g} s"
        )
    return (
        f"{name} {before}{', '.join(f'{value:g} {preposition} {time:g} s' for time, value in rows)}"
    )


def loop_plot(scenario: Scenario, loop: ControlLoop, recording: Recording) -> Plot:
    """Return the plot of the set points, with their steps, and of the controlled variables."""
    names = list(dict.fromkeys((*loop.controller.setpoints, *loop.controller.measured_columns)))
    units = run_column_units(scenario.problem)
    start = scenario.problem.start_time
    time = recording["time"]
    end = float(time[-1]) if time[-1] > start else start + scenario.problem.duration
    setpoints = loop.setpoint.segments(loop.controller.setpoints, start, end - start)
    figure, axes = new_figure(
        len(names), 1, height=0.9 + 1.9 * len(names), sharex=True, squeeze=False
    )
    for name, axis in zip(names, axes[:, 0], strict=True):
        factor, display_unit = display_scale(name)
        unit = display_unit or units.get(name, "")
        if name in recording:
            axis.plot(time, recording[name] * factor, color=BLUE, label="measured")
        if name in loop.controller.setpoints:
            instants, values = segment_vertices(
                setpoints, start, loop.controller.setpoints.index(name)
            )
            axis.plot(
                instants,
                values * factor,
                color=BLACK,
                linestyle="--",
                linewidth=0.9,
                label="set point",
            )
        axis.set_ylabel(f"{name}\n[{unit}]" if unit else name)
    axes[-1, 0].set_xlabel("time [s]")
    figure.align_ylabels()
    legend_below(figure, axes[0, 0])
    return Plot(
        "loop",
        f"Set points and measurements; sample time of the controller {loop.sample_time:g} s.",
        figure,
    )


def segment_vertices(segments: PiecewiseLinear, start: float, i: int) -> tuple[Any, Any]:
    """Return times [s] and values at both ends of every segment, so that steps are drawn as
    vertical lines.
    """
    starts = segments.starts(start)
    first = segments.values[:, i]
    last = first + segments.slopes[:, i] * (segments.ends - starts)
    return np.column_stack([starts, segments.ends]).ravel(), np.column_stack([first, last]).ravel()


def controller_table(scenario: Scenario, loop: ControlLoop) -> Table:
    """Return the parameters of a controller, in the units that follow from its measurement and
    manipulated input.
    """
    units = run_column_units(scenario.problem)
    y, u = (
        units.get(names[0]) or "1"
        for names in (loop.controller.measured_columns, loop.controller.inputs)
    )
    title = f"Parameters of the controller, {type(loop.controller).__name__}"
    table = parameter_table(loop.controller, "controller", title)
    resolved = [relative_unit(str(unit), y, u) for unit in table.columns["unit"]]
    return dataclasses.replace(table, columns={**table.columns, "unit": TableColumn(resolved)})
