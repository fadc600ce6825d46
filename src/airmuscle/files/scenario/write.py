"""Writing of scenarios with input signals, drivers and control loops as TOML that `load_scenario` reads back."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core import ParameterError
from ...engine.loop import ControlLoop, InputSignal, Periodic, SampledSignal, Schedule, WithDrivers
from ...physics.plant.plant import Plant
from ..library import Location, model_table, tables_toml, write_text
from .scenario import Scenario, build_scenario


def scenario_text(scenario: Scenario) -> str:
    """The text of the file of a scenario: the plant, the input or the control loop, and the run, in SI units.

    All parameters are written with all digits and the initial state by all states of the plant, so that the text is
    read back as an equal scenario. Raises ParameterError for a controller that is no ControlLaw, an input signal that
    has no form in a file, or a plant, an integrator or a law that no file describes.
    """
    tables = _tables(scenario)
    text = tables_toml(tables)
    if _tables(build_scenario(tomllib.loads(text), Location(scenario.title, "", Path()))) != tables:
        raise ParameterError(f"scenario '{scenario.title}': a file does not describe it all; write a Python program.")
    return text


def save_scenario(scenario: Scenario, path: str | Path) -> Path:
    """Write a scenario to a file that `load_scenario` reads; the file is complete or unchanged.

    Raises FileError, and ParameterError as `scenario_text`.
    """
    return write_text(Path(path), scenario_text(scenario))


def _tables(scenario: Scenario) -> dict[str, Any]:
    """The tables of a scenario, whose values may be models."""
    problem = scenario.problem
    if problem.control_state is not None or not isinstance(problem.output_times, float | int | None):
        raise ParameterError(
            f"scenario '{scenario.title}': a file does not describe a continued run, or output times that are not "
            "equidistant; write it as a program in Python."
        )
    run: dict[str, Any] = {
        "duration": problem.duration, "start_time": problem.start_time, "output_times": problem.output_times,
        "initial_state": dict(scenario.initial_state), "integrator": problem.integrator,
    }  # fmt: skip
    signal = problem.input
    return {
        "title": scenario.title,
        "plant": {key: value for key, value in model_table(scenario.plant).items() if key != "model"},
        "input": _loop_table(signal, scenario.plant) if isinstance(signal, ControlLoop) else _signal_table(signal),
        "run": {key: value for key, value in run.items() if value is not None},
        **({"output": {"columns": list(scenario.columns)}} if scenario.columns else {}),
    }


def _loop_table(loop: ControlLoop, plant: Plant) -> dict[str, Any]:
    """The table [input] of a control loop; a controller that contains the plant has it from [plant]."""
    if not getattr(loop.controller, "from_file", False):
        raise ParameterError(
            f"scenario: {type(loop.controller).__name__} has no form in a file; write the loop as a program in Python."
        )
    controller = {
        **{name: value for name, value in model_table(loop.controller).items() if value != plant},
        "sample_time": loop.sample_time,
        "setpoint": _signal_table(loop.setpoint),
    }
    drivers = {"drivers": _drivers(loop.drivers)} if loop.drivers else {}
    return {**_signal_table(loop.other_inputs), "controller": controller, **drivers}


def _signal_table(signal: InputSignal) -> dict[str, Any]:
    """The table of an input signal. Raises ParameterError for one without a form in a file."""
    if isinstance(signal, WithDrivers) and not isinstance(signal.inner, WithDrivers):
        return {**_signal_table(signal.inner), "drivers": _drivers(signal.drivers)}
    if isinstance(signal, Periodic) and isinstance(signal.inner, Schedule | SampledSignal):
        return {**_signal_table(signal.inner), "period": signal.period}
    if isinstance(signal, Schedule):
        return _rows(signal.changes)
    if isinstance(signal, SampledSignal):
        return {"model": "SampledSignal", **_rows(signal.points)}
    raise ParameterError(
        f"scenario: the input signal {type(signal).__name__} has no form in a file; use Schedule, SampledSignal, "
        "Periodic or WithDrivers."
    )


def _drivers(drivers: Mapping[str, Any]) -> dict[str, Any]:
    return {name: list(each) if isinstance(each, tuple) else each for name, each in drivers.items()}


def _rows(signals: Mapping[str, Any]) -> dict[str, Any]:
    return {name: [[float(t), float(v)] for t, v in points] for name, points in signals.items()}
