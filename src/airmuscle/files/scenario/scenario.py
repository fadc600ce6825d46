"""Scenario: a simulation as a TOML file with the tables [plant], [input], [run] and [output].

    [plant]
    muscle = "dmsp-20-300"                      a library name or a muscle file; or a table [plant.muscle] with
                                                library = "dmsp-20-300" and the parts to replace, or with all parts
    gas = "Isothermal"                          optional; WallHeatTransfer by default
    [plant.circuit]                             model = "FillDischarge" with supply, fill and discharge
    [plant.mechanism]                           model = "HangingMass", mass = "5 kg"
    [input]                                     see inputs.py; with a controller, controller.py
    fill = [["5 s", 1], ["15 s", 0]]            each input of the plant: instants, and the value from each instant on
    [run]
    duration = "25 s"
    output_times = "10 ms"                      optional
    initial_state = { pressure = "0 bar" }      optional: equilibrium at this pressure, of each muscle "left.pressure";
                                                or a state, position = "10 mm"; or all states of the plant by name
    integrator = { model = "Rodas4", rtol = 1e-8 }  optional
    [output]
    columns = ["pressure", "force"]             optional: columns of the recording besides time; all by default
    [observed]                                  written by fit-dynamic, read by predict: as in a study of fit-dynamic
    [uncertainty]                               the same: see plant_uncertainty.py

Components are tables with `model` and their parameters; new components need no new grammar.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...bench.identify.prediction import PlantUncertainty
from ...core.absolute_pressure import ambient_pressure
from ...core.errors import FileError, ParameterError, suggestion
from ...core.short_repr import ShortRepr
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.inputs import InputSignal
from ...engine.run import Integrator, Problem, solve
from ...physics.plant.plant import Plant
from ...recording import Recording
from ..library.build import build
from ..library.files import is_path, list_plants, read_toml
from ..library.location import Location, check_keys, check_type, located_errors, read_finite_number, read_text
from ..library.plant_file import SCENARIO_TABLES, build_plant, plant_tables
from .controller import build_control_loop, signal_units
from .initial_state import build_initial_state
from .inputs import build_input_signal
from .plant_uncertainty import read_plant_uncertainty
from .study_tables import read_observed

TABLES = ("title", *SCENARIO_TABLES, "observed", "uncertainty")
RUN = ("duration", "start_time", "output_times", "initial_state", "integrator")
OUTPUT = ("columns",)
DEFAULT_INITIAL_STATE: Mapping[str, Any] = MappingProxyType({"pressure": 0.0})
"""Default initial state of a run: equilibrium at ambient pressure."""


@dataclasses.dataclass(frozen=True, repr=False)
class Scenario(ShortRepr):
    """A simulation problem with a title and the columns to write; all numbers SI."""

    title: str
    problem: Problem
    columns: tuple[str, ...] = ()
    """Columns of the recording besides time; all if empty."""
    uncertainty: PlantUncertainty | None = None
    """That of the fit of the plant, for predictions; a simulation does not use it."""
    observed: Mapping[str, tuple[float, str]] = dataclasses.field(default_factory=dict)
    """Standard deviation of the sensor [SI] and column of each output that the fit of the plant observed."""
    defaults: tuple[str, ...] = ()
    """Keys of [run] that the file does not state."""

    @property
    def plant(self) -> Plant:
        """The plant of the problem."""
        assert isinstance(self.problem.system, Plant)
        return self.problem.system

    @property
    def initial_state(self) -> Mapping[str, float]:
        """The initial state by name."""
        return self.problem.initial_state or {}

    def simulate(self, *, complete: bool = True) -> Recording:
        """The simulated run as a Recording; see `airmuscle.simulate`."""
        solution = solve(self.problem)
        return (solution.raise_if_incomplete() if complete else solution).recording

    def select_columns(self, recording: Recording) -> Recording:
        """The recording with time and the columns of the scenario."""
        kept = {name: recording[name] for name in recording if not self.columns or name in ("time", *self.columns)}
        return dataclasses.replace(recording, columns=kept)


def load_scenario(path: str | Path) -> Scenario:
    """The scenario in a file, or that of a plant of the library by its complete name.

    A file of this name takes precedence. Raises FileError, ParameterError, UnitError or UnknownNameError with the
    location.
    """
    file = Path(path)
    if str(path) in list_plants() and not is_path(str(path)) and not file.exists():
        tables, location = plant_tables(str(path))
        return build_scenario({key: tables[key] for key in TABLES if key in tables}, location)
    if not is_path(str(path)) and not file.exists():
        raise FileError(f"{path}: there is no such file, and no such plant; plants are {', '.join(list_plants())}.")
    return build_scenario(read_toml(file), Location(str(file), "", file.parent))


def build_scenario(
    tables: Mapping[str, Any],
    location: Location,
    plant: Plant | None = None,
    equilibrium: dict[str, float] | None = None,
) -> Scenario:
    """The scenario of the tables of a file.

    `plant` replaces the table [plant], `equilibrium` replaces the computed initial equilibrium. Raises FileError,
    ParameterError, UnitError or UnknownNameError with the location.
    """
    check_keys(tables, TABLES, location)
    for key in ("plant", "run"):
        _check_table(tables.get(key), key, location)
    plant = plant or build_plant(tables["plant"], location.inside("plant"))
    with ambient_pressure(plant.ambient.pressure):
        return _build_run(tables, location, plant, equilibrium)


def _build_run(
    tables: Mapping[str, Any], location: Location, plant: Plant, equilibrium: dict[str, float] | None
) -> Scenario:
    """The scenario of a plant, whose ambient pressure is that of the texts."""
    run, in_run = tables["run"], location.inside("run")
    check_keys(run, RUN, in_run)
    if "duration" not in run:
        raise ParameterError(f"{in_run}: 'duration' is missing; write it as duration = \"25 s\".")
    duration = _read_duration(run, "duration", in_run)
    in_input, input_table = location.inside("input"), _check_table(tables.get("input", {}), "input", location)
    open_loop = _build_input_signal(input_table, plant, in_input)  # before the search for an equilibrium
    initial_state = build_initial_state(
        run.get("initial_state", DEFAULT_INITIAL_STATE), plant, in_run.inside("initial_state"), equilibrium
    )
    integrator = (
        _build_model(run["integrator"], Integrator, in_run.inside("integrator")) if "integrator" in run else None
    )
    start_time = read_finite_number(run.get("start_time", 0.0), "s", f"{in_run}, start_time")
    output_times = _read_duration(run, "output_times", in_run) if "output_times" in run else None
    signal: InputSignal | ControlLoop | None = open_loop
    if signal is None:
        signal = build_control_loop(input_table, plant, signal_units(plant, initial_state), in_input)
    with located_errors(in_input):
        problem = Problem(plant, signal, duration, initial_state, start_time, output_times, integrator)
    output_table = _check_table(tables.get("output", {}), "output", location)
    return Scenario(
        title=read_text(tables, "title", location, needed=False) or Path(location.file).stem,
        problem=problem,
        columns=_read_columns(output_table, list(run_column_units(problem)), location.inside("output")),
        uncertainty=_read_uncertainty(tables, plant, location),
        observed=_read_observed(tables, plant, location),
        defaults=tuple(key for key in RUN if key not in run),
    )


def _check_table(value: Any, key: str, location: Location) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        what = "is missing" if value is None else f"is {value!r}; it must be a table"
        raise ParameterError(f"{location}: the table [{key}] {what}.")
    return value


def _read_observed(tables: Mapping[str, Any], plant: Plant, location: Location) -> dict[str, tuple[float, str]]:
    if "observed" not in tables:
        return {}
    return read_observed(_check_table(tables["observed"], "observed", location), plant, location.inside("observed"))


def _read_uncertainty(tables: Mapping[str, Any], plant: Plant, location: Location) -> PlantUncertainty | None:
    if "uncertainty" not in tables:
        return None
    return read_plant_uncertainty(tables["uncertainty"], plant, location.inside("uncertainty"))


def _build_input_signal(table: Mapping[str, Any], plant: Plant, location: Location) -> InputSignal | None:
    """The input signal of a table; None if the table has a controller, whose units follow from the initial state."""
    return None if "controller" in table else build_input_signal(table, plant.input_variables, location)


def run_column_units(problem: Problem) -> dict[str, str]:
    """Units of all columns of a run of a plant; '' if unknown."""
    assert isinstance(problem.system, Plant)
    units = {"time": "s"} | signal_units(problem.system, problem.initial_state or {})
    return units | (problem.input.units(units) if isinstance(problem.input, ControlLoop) else {})


def _read_duration(table: Mapping[str, Any], key: str, location: Location) -> float:
    """A positive duration [s]."""
    duration = read_finite_number(table[key], "s", f"{location}, {key}")
    if not duration > 0:
        raise ParameterError(f"{location}, {key} is {table[key]!r}; it must be greater than zero.")
    return duration


def initial_pressure(tables: Mapping[str, Any], location: Location, plant: Plant) -> float | None:
    """Gauge pressure [Pa] of the initial equilibrium of a plant; None if the run starts from another state."""
    start = tables["run"].get("initial_state", DEFAULT_INITIAL_STATE)
    if not isinstance(start, Mapping) or set(start) - {"pressure"}:
        return None
    with ambient_pressure(plant.ambient.pressure):
        return read_finite_number(
            start.get("pressure", 0.0), "Pa", f"{location.inside('run').inside('initial_state')}, pressure"
        )


def _read_columns(table: Mapping[str, Any], known: Sequence[str], location: Location) -> tuple[str, ...]:
    check_keys(table, OUTPUT, location)
    columns = table.get("columns", [])
    if not isinstance(columns, list) or not all(isinstance(name, str) for name in columns):
        raise ParameterError(
            f'{location}, columns is {columns!r}; it must be a list of names, such as ["pressure", "force"].'
        )
    for name in columns:
        if name not in known:
            raise ParameterError(
                f"{location}: the run has no column '{name}'; there are {', '.join(known)}.{suggestion(name, known)}"
            )
    return tuple(columns)


def _build_model(value: Any, kind: type[Any], location: Location) -> Any:
    table = {"model": value} if isinstance(value, str) else value
    return check_type(build(table, location, kind=kind), kind, location)
