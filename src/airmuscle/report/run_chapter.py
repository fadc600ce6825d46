"""A simulated run as a chapter: its courses, what was commanded and what came of it, parameters, settings, sources."""

from __future__ import annotations

from collections.abc import Sequence

from ..control.control_loop import COMMAND, MEASURED, SETPOINT, ControlLoop
from ..control.inputs import InputSignal, Periodic, SampledSignal, Schedule
from ..control.with_drivers import WithDrivers
from ..core.plotting import BLACK, BLUE, legend_below, new_figure
from ..core.reference import cite
from ..recording import Recording
from ..scenario.scenario import Scenario
from .chapter import Chapter, Plot
from .loop_chapter import controller_table, corners, loop_plot
from .parameters import parameter_table

SHOWN = ("pressure", "contraction", "force", "friction", "position", "angle", "speed", "angular_speed")
"""Columns that the figure draws, in this order; the file holds all."""
MOST_PIECES = 300
"""Pieces of a command that a figure tells apart; of a longer one it shows the beginning."""
MOST_HELD = 50_000
"""Pieces that a figure draws where no driver makes pulses, which it need not tell apart."""
MOST_CHANGES = 6
"""Changes of an input that are spelt out."""


def run_chapter(scenario: Scenario, recording: Recording) -> Chapter:
    """The chapter of a run, whole or as far as it came."""
    notes = "\n\n".join(_sentence(note) for note in recording.notes)
    loop = scenario.command if isinstance(scenario.command, ControlLoop) else None
    plots = [loop_plot(scenario, loop, recording)] if loop else []
    plots.append(Plot("run", f"{scenario.title}, simulated.", recording.plot(*_shown(recording))))
    if scenario.plant.inputs:
        plots.append(_inputs(scenario, recording))
    return Chapter(
        paper="simulation",
        title=scenario.title,
        summary=f"{_length(scenario, recording)} The recording is recording.csv.\n\n{notes}",
        plots=tuple(plots),
        tables=(
            parameter_table(scenario.plant, "parameters", "Parameters of the plant"),
            *((controller_table(scenario, loop),) if loop else ()),
        ),
        references=tuple(cite((scenario.plant, loop))),
        chosen=_settings(scenario),
    )


def _sentence(note: str) -> str:
    return f"{note[:1].upper()}{note[1:].rstrip('.')}."


def _length(scenario: Scenario, recording: Recording) -> str:
    reached, end = float(recording["time"][-1]), scenario.start_time + scenario.duration
    if reached < end:
        return f"A run of {scenario.duration:g} s that ended early, at {reached:.6g} s; the last note says why."
    return f"A run of {scenario.duration:g} s."


def _shown(recording: Recording) -> list[str]:
    own = [name for name in recording if not name.startswith((SETPOINT, MEASURED, COMMAND))]
    return [name for kind in SHOWN for name in own if name.rpartition(".")[2] == kind]


def _inputs(scenario: Scenario, recording: Recording) -> Plot:
    """Every input as the plant had it, with its jumps, and behind it what a driver was told."""
    command, inputs = scenario.command, scenario.plant.inputs
    if isinstance(command, ControlLoop):
        command = command.as_open_loop(recording)
    units = {given.name: "" if given.unit == "1" else f"\n[{given.unit}]" for given in scenario.plant.input_variables}
    start, reached = scenario.start_time, float(recording["time"][-1])
    end = reached if reached > start else start + scenario.duration
    had = command.segments(inputs, start, end - start)
    shortened = had.ends.size > (MOST_PIECES if isinstance(command, WithDrivers) else MOST_HELD)
    if shortened:
        had = command.segments(inputs, start, float(had.ends[MOST_PIECES - 1]) - start)
    told = (
        command.inner.segments(inputs, start, float(had.ends[-1]) - start) if isinstance(command, WithDrivers) else None
    )
    figure, axes = new_figure(
        len(inputs), 1, height=0.9 + 0.9 * len(inputs), sharex=True, sharey=len(set(units.values())) == 1, squeeze=False
    )  # one height for all of one unit: openings are compared
    for i, (name, axis) in enumerate(zip(inputs, axes[:, 0], strict=True)):
        if told is not None:
            axis.plot(*corners(told, start, i), color=BLACK, linestyle="--", linewidth=0.9, label="command")
        axis.plot(*corners(had, start, i), color=BLUE, label="what the plant had")
        axis.set_ylabel(f"{name}{units[name]}")
    axes[-1, 0].set_xlabel("time [s]")
    figure.align_ylabels()
    if told is not None:
        legend_below(figure, axes[0, 0])
    part = f"; the first {MOST_PIECES} pieces" if shortened else ""
    behind = "; dashed, what the drivers were told" if told is not None else ""
    return Plot("inputs", f"Inputs of the plant{part}{behind}.", figure)


def _settings(scenario: Scenario) -> tuple[tuple[str, str, str], ...]:
    start = ", ".join(f"{name} {value:.6g}" for name, value in scenario.start.items())
    return (
        ("method", str(scenario.method), "scenario"),
        ("start (SI)", start, "scenario"),
        ("command", in_words(scenario.command), "scenario"),
    )


def in_words(command: InputSignal | ControlLoop) -> str:
    """A command in a sentence, however long its tables are."""
    if isinstance(command, ControlLoop):
        controller = command.controller
        looks = f"every {command.period:g} s {type(controller).__name__} commands {', '.join(controller.inputs)}"
        others = WithDrivers(command.other_inputs, command.drivers) if command.drivers else command.other_inputs
        return f"{looks}; set point: {in_words(command.setpoint)}; beside: {in_words(others)}"
    if isinstance(command, WithDrivers):
        chains = (f"{name} by {', '.join(map(str, chain))}" for name, chain in command.chains.items())
        return f"{in_words(command.inner)}; driven: {'; '.join(chains)}"
    if isinstance(command, Periodic):
        return f"every {command.period:g} s: {in_words(command.inner)}"
    if isinstance(command, Schedule):
        return "; ".join(_changes(name, rows, "from") for name, rows in command.changes.items()) or "none"
    if isinstance(command, SampledSignal):
        return "; ".join(_changes(name, rows, "at") for name, rows in command.points.items()) or "none"
    return str(command)


def _changes(name: str, rows: Sequence[tuple[float, float]], word: str) -> str:
    if len(rows) > MOST_CHANGES:
        values = [value for _, value in rows]
        return (
            f"{name}: {len(rows)} values from {min(values):g} to {max(values):g}, {rows[0][0]:g} to {rows[-1][0]:g} s"
        )
    return f"{name} {', '.join(f'{value:g} {word} {time:g} s' for time, value in rows)}"
