"""Scenario: a simulation as a TOML file with the tables [plant], [input], [run] and [output];
docs/guides/scenario.md.

Components are tables with `model` and their parameters; new components need no new grammar. Beside
these tables are [observed] and [uncertainty], which fit-dynamic writes and predict reads, see
plant_uncertainty.py, and [episodes] of an arm that fit-joint has identified, see episodes_table.py.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...bench.prediction import PlantUncertainty
from ...core import FileError, ParameterError, Reference, ShortRepr, ambient_pressure, check_known
from ...engine.loop import ControlLoop, InputSignal
from ...engine.run import Integrator, Problem, solve
from ...physics.plant.plant import Plant
from ...recording import Recording
from ..library import (
    SCENARIO_TABLES,
    build_plant,
    custom_field,
    is_path,
    list_plants,
    plant_tables,
    read_toml,
)
from ..library.files import Location, check_keys, located_errors, read_finite_number, read_table
from .controller import build_control_loop, signal_units
from .initial_state import build_initial_state, read_initial_table
from .plant_uncertainty import read_plant_uncertainty
from .values import Number, build_input_signal, read_observed, required_table, table_reader

MAX_ROWS = 2_000_000
"""Maximum number of rows of a run that a command writes (chosen): 300 MB of a plant with one
muscle.
"""
DEFAULT_INITIAL_STATE: Mapping[str, Any] = MappingProxyType({"pressure": 0.0})
"""Default initial state of a run: equilibrium at ambient pressure."""


@dataclasses.dataclass(frozen=True)
class RunTable:
    """Table [run] of a scenario."""

    duration: float = custom_field(
        Number("s", positive=True), 'duration of the run, such as duration = "25 s"'
    )
    start_time: float = custom_field(Number("s"), "time at the start of the run", default=0.0)
    output_times: float | None = custom_field(
        Number("s", positive=True), "sample time of the rows", default=None
    )
    initial_state: Mapping[str, Any] = custom_field(
        read_initial_table, "pressures or states", default_factory=lambda: DEFAULT_INITIAL_STATE
    )
    integrator: Integrator | None = None

    def __post_init__(self) -> None:
        rows = 0.0 if self.output_times is None else self.duration / self.output_times
        if rows > MAX_ROWS:
            raise ParameterError(
                f"output_times of {self.output_times:g} s gives {rows:.3g} rows in"
                f" {self.duration:g} s; at most {MAX_ROWS} are written. Choose a longer sample"
                " time."
            )


@dataclasses.dataclass(frozen=True)
class OutputTable:
    """Table [output] of a scenario."""

    columns: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class ScenarioTables:
    """Tables of a scenario, which are keys of its file; `input` depends on the initial state and is
    read later.
    """

    plant: Plant
    run: RunTable
    title: str = ""
    input: Mapping[str, Any] = custom_field(
        read_table, "input signals or a controller", default_factory=dict
    )
    output: OutputTable = OutputTable()
    observed: Mapping[str, tuple[float, str]] = custom_field(
        read_observed, "of a fit", default_factory=dict
    )
    uncertainty: PlantUncertainty | None = custom_field(
        read_plant_uncertainty, "of a fit", default=None
    )
    episodes: Mapping[str, Any] = custom_field(
        read_table, "record of an identified arm", default_factory=dict
    )
    # of an entry of the library, so that its copy is a scenario; a simulation does not use them
    provenance: str = ""
    note: str = ""
    warning: str = ""
    sources: Mapping[str, str] = custom_field(
        read_table, "source of each number, by its path", default_factory=dict
    )
    reference: tuple[Reference, ...] = ()


TABLES = ("title", *SCENARIO_TABLES, "observed", "uncertainty", "episodes")


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
    """Standard deviation of the sensor [SI] and column of each output that the fit of the plant
    observed.
    """
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
        selected = {
            name: recording[name]
            for name in recording
            if not self.columns or name in ("time", *self.columns)
        }
        return dataclasses.replace(recording, columns=selected)


def load_scenario(path: str | Path) -> Scenario:
    """The scenario in a file, or that of a plant of the library by its complete name.

    A file of this name takes precedence. Raises FileError, ParameterError, UnitError or
    UnknownNameError with the location.
    """
    return build_scenario(*scenario_tables(path))


def scenario_tables(path: str | Path) -> tuple[Mapping[str, Any], Location]:
    """The tables of a scenario with their location. Raises as `load_scenario`."""
    file = Path(path)
    if str(path) in list_plants() and not is_path(str(path)) and not file.exists():
        return plant_tables(str(path))
    if not is_path(str(path)) and not file.exists():
        raise FileError(
            f"{path}: there is no such file, and no such plant; plants are"
            f" {', '.join(list_plants())}."
        )
    return read_toml(file), Location.of_file(file)


def build_scenario(
    tables: Mapping[str, Any],
    location: Location,
    plant: Plant | None = None,
    equilibrium: dict[str, float] | None = None,
) -> Scenario:
    """The scenario of the tables of a file. `plant` replaces the table [plant], `equilibrium` the
    computed initial equilibrium. Raises as `load_scenario`."""
    check_keys(tables, [field.name for field in dataclasses.fields(ScenarioTables)], location)
    for key in ("plant", "run"):
        required_table(tables, key, location)
    plant = plant or build_plant(tables["plant"], location.inside("plant"))
    with ambient_pressure(plant.ambient.pressure):  # that of the texts
        reader = table_reader(plant)
        read: ScenarioTables = reader.build(tables, location, {"plant": plant}, kind=ScenarioTables)
        run = read.run
        in_input = location.inside("input")
        signal: InputSignal | ControlLoop | None = None
        if (
            "controller" not in read.input
        ):  # before the search for an equilibrium, from which units of a loop follow
            signal = build_input_signal(read.input, plant.input_variables, in_input)
        place = location.inside("run").inside("initial_state")
        initial_state = build_initial_state(run.initial_state, plant, place, equilibrium)
        if signal is None:
            signal = build_control_loop(
                read.input, plant, signal_units(plant, initial_state), in_input
            )
        with located_errors(in_input):
            problem = Problem(
                plant,
                signal,
                run.duration,
                initial_state,
                run.start_time,
                run.output_times,
                run.integrator,
            )
        known = list(run_column_units(problem))
        check_known(
            f"{location.inside('output')}: the run has no column", read.output.columns, known
        )
        return Scenario(
            title=read.title.strip() or Path(location.file).stem,
            problem=problem,
            columns=read.output.columns,
            uncertainty=read.uncertainty,
            observed=read.observed,
            defaults=tuple(
                field.name
                for field in dataclasses.fields(RunTable)
                if field.name not in tables["run"]
            ),
        )


def run_column_units(problem: Problem) -> dict[str, str]:
    """Units of all columns of a run of a plant; '' if unknown."""
    assert isinstance(problem.system, Plant)
    units = {"time": "s"} | signal_units(problem.system, problem.initial_state or {})
    return units | (problem.input.units(units) if isinstance(problem.input, ControlLoop) else {})


def initial_pressure(tables: Mapping[str, Any], location: Location, plant: Plant) -> float | None:
    """Gauge pressure [Pa] of the initial equilibrium of a plant; None if the run starts from
    another state.
    """
    start = tables["run"].get("initial_state", DEFAULT_INITIAL_STATE)
    if not isinstance(start, Mapping) or set(start) - {"pressure"}:
        return None
    with ambient_pressure(plant.ambient.pressure):
        place = location.inside("run").inside("initial_state").at("pressure")
        return read_finite_number(start.get("pressure", 0.0), "Pa", place)
