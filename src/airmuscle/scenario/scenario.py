"""Scenario: a simulation as a TOML file with the tables [plant], [input], [run] and [output].

    [plant]
    muscle = "dmsp-20-300"                      a library name or a muscle file; or a table [plant.muscle] with
                                                library = "dmsp-20-300" and the parts to replace, or with all parts
    gas = "Isothermal"                          optional; polytropic by default
    [plant.circuit]                             model = "FillDischarge" with supply, fill and discharge
    [plant.mechanism]                           model = "HangingMass", mass = "5 kg"
    [input]                                     see inputs.py; with a controller, controller.py
    fill = [["5 s", 1], ["15 s", 0]]            each input of the plant: instants, and the value from each instant on
    [run]
    duration = "25 s"
    output_times = "10 ms"                      optional
    initial_state = { pressure = "0 bar" }      optional: equilibrium at this pressure; or a state, position = "10 mm"
    integrator = { model = "Rodas4", rtol = 1e-8 }  optional
    [output]
    columns = ["pressure", "force"]             optional: columns of the recording besides time; all by default

Components are tables with `model` and their parameters; new components need no new grammar.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Any

from ..analysis.equilibrium import find_equilibrium
from ..characteristic.base import ForceLaw
from ..control.control_loop import ControlLoop
from ..control.inputs import InputSignal
from ..core.errors import ParameterError, suggestion
from ..library.build import build
from ..library.catalogue import load_law
from ..library.entry import MISSING_GEOMETRY, Entry
from ..library.files import read_toml
from ..library.location import Location, check_keys, check_type, located_errors, read_finite_number, read_text
from ..library.scaling import scale_entry
from ..muscle import Muscle
from ..plant.plant import Plant
from ..recording import Recording
from ..simulation import Integrator, Problem, solve
from .controller import build_control_loop, signal_units
from .inputs import build_input_signal

TABLES = ("title", "plant", "input", "run", "output")
RUN = ("duration", "start_time", "output_times", "initial_state", "integrator")
OUTPUT = ("columns",)
SIZES = ("resting_length", "diameter")
"""Sizes to which a table that names a library entry may scale its muscle."""
DEFAULT_INITIAL_STATE: Mapping[str, Any] = MappingProxyType({"pressure": 0.0})
"""Default initial state of a run: equilibrium at ambient pressure."""


@dataclasses.dataclass(frozen=True)
class Scenario:
    """A simulation problem with a title and the columns to write; all numbers SI."""

    title: str
    problem: Problem
    columns: tuple[str, ...] = ()
    """Columns of the recording besides time; all if empty."""

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
    """The scenario in a file. Raises FileError, ParameterError, UnitError or UnknownNameError with the location."""
    file = Path(path)
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
    run, in_run = tables["run"], location.inside("run")
    check_keys(run, RUN, in_run)
    if "duration" not in run:
        raise ParameterError(f"{in_run}: 'duration' is missing; write it as duration = \"25 s\".")
    duration = _read_duration(run, "duration", in_run)
    initial_state = _build_initial_state(
        run.get("initial_state", DEFAULT_INITIAL_STATE), plant, in_run.inside("initial_state"), equilibrium
    )
    in_input, input_table = location.inside("input"), _check_table(tables.get("input", {}), "input", location)
    integrator = (
        _build_model(run["integrator"], Integrator, in_run.inside("integrator")) if "integrator" in run else None
    )
    start_time = read_finite_number(run.get("start_time", 0.0), "s", f"{in_run}, start_time")
    output_times = _read_duration(run, "output_times", in_run) if "output_times" in run else None
    signal = _build_input(input_table, plant, initial_state, in_input)
    with located_errors(in_input):
        problem = Problem(plant, signal, duration, initial_state, start_time, output_times, integrator)
    output_table = _check_table(tables.get("output", {}), "output", location)
    return Scenario(
        title=read_text(tables, "title", location, needed=False) or Path(location.file).stem,
        problem=problem,
        columns=_read_columns(output_table, list(run_column_units(problem)), location.inside("output")),
    )


def _check_table(value: Any, key: str, location: Location) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        what = "is missing" if value is None else f"is {value!r}; it must be a table"
        raise ParameterError(f"{location}: the table [{key}] {what}.")
    return value


def _build_input(
    table: Mapping[str, Any], plant: Plant, initial_state: Mapping[str, float], location: Location
) -> InputSignal | ControlLoop:
    if "controller" not in table:
        return build_input_signal(table, plant.input_variables, location)
    return build_control_loop(table, plant, signal_units(plant, initial_state), location)


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


def build_plant(table: Mapping[str, Any], location: Location) -> Plant:
    """The plant of a table [plant]. Raises FileError, ParameterError, UnitError or UnknownNameError."""
    value = table.get("muscle")
    if value is None:
        raise ParameterError(
            f"{location}: 'muscle' is missing; name a library entry or a muscle file, or write [plant.muscle]."
        )
    muscle: Muscle | tuple[Muscle, ...]
    if isinstance(value, list):
        muscle = tuple(build_muscle(item, location.inside(f"muscle[{i}]")) for i, item in enumerate(value))
    else:
        muscle = build_muscle(value, location.inside("muscle"))
    others = {"model": "Plant", **{key: item for key, item in table.items() if key != "muscle"}}
    plant: Plant = check_type(build(others, location, {"muscle": muscle}), Plant, location)
    return plant


def build_muscle(value: Any, location: Location) -> Muscle:
    """The muscle of a library name, a file or a table. Raises FileError, ParameterError, UnitError or
    UnknownNameError."""
    if isinstance(value, Mapping):
        table = {"model": "Muscle", **value}
        name = table.pop("library", None)
        parts = {} if name is None else _entry_parts(_load_scaled(name, table, location), table, location)
        muscle: Muscle = build(table, location, parts)
        return muscle
    entry = _load_entry(value, location)
    with located_errors(location):
        return entry.muscle


def _load_scaled(name: Any, table: dict[str, Any], location: Location) -> Entry:
    """The entry of this name, scaled to the sizes of the table, which are removed from it."""
    entry = _load_entry(name, location.inside("library"))
    sizes = {key: read_finite_number(table.pop(key), "m", f"{location}, {key}") for key in SIZES if key in table}
    with located_errors(location):
        return scale_entry(entry, **sizes)


def _load_entry(value: Any, location: Location) -> Entry:
    if not isinstance(value, str):
        raise ParameterError(f"{location} is {value!r}; name a library entry or a muscle file.")
    with located_errors(location):
        return load_law(location.folder / value if value.endswith(".toml") else value)


def _entry_parts(entry: Entry, replaced: Mapping[str, Any], location: Location) -> dict[str, Any]:
    """Parts of an entry that a table does not replace; the table may add missing parts, such as a geometry."""
    names = [f.name for f in dataclasses.fields(Muscle) if f.name not in ("contractile", "name")]
    parts = {"contractile": entry.characteristic, **{name: getattr(entry, name, None) for name in names}}
    if "contractile" in replaced:
        del parts["validity_range"]  # it belongs to the replaced law
    kept = {name: part for name, part in parts.items() if part is not None and name not in replaced}
    if not isinstance(kept.get("contractile"), ForceLaw | NoneType):
        raise ParameterError(
            f"{location}: {entry.name} is {type(entry.characteristic).__name__}, which is not solved for the force; "
            "a plant needs a ForceLaw. In Python, as_force_law(law, validity range) makes one."
        )
    if "geometry" not in {*kept, *replaced}:
        raise ParameterError(f"{location}: {entry.name} lacks {MISSING_GEOMETRY}.")
    return kept


def initial_pressure(tables: Mapping[str, Any], location: Location) -> float | None:
    """Gauge pressure [Pa] of the initial equilibrium of a run; None if the run starts from another state."""
    start = tables["run"].get("initial_state", DEFAULT_INITIAL_STATE)
    if not isinstance(start, Mapping) or set(start) - {"pressure"}:
        return None
    return read_finite_number(
        start.get("pressure", 0.0), "Pa", f"{location.inside('run').inside('initial_state')}, pressure"
    )


def _build_initial_state(
    table: Any, plant: Plant, location: Location, equilibrium: dict[str, float] | None
) -> dict[str, float]:
    if not isinstance(table, Mapping):
        raise ParameterError(
            f'{location} is {table!r}; it must be a table. Write initial_state = {{ pressure = "0 bar" }}.'
        )
    coordinates = {
        name: unit for c in plant.mechanism.coordinates for name, unit in ((c.name, c.unit), (c.speed, f"{c.unit}/s"))
    }
    units = {"pressure": "Pa", **coordinates}
    check_keys(table, tuple(units), location)
    values = {key: read_finite_number(value, units[key], f"{location}, {key}") for key, value in table.items()}
    pressure = values.pop("pressure", 0.0)
    with located_errors(location):
        if values:
            return plant.state_at(pressure=pressure, **values)
        return find_equilibrium(plant, pressure=pressure) if equilibrium is None else equilibrium


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
    return check_type(build({"model": value} if isinstance(value, str) else value, location), kind, location)
