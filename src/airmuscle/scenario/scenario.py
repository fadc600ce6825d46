"""A simulation written down as a file: [plant], [command], [run] and [output].

    [plant]
    muscle = "dmsp-20-300"                      a library name or a muscle file; or a table [plant.muscle] with
                                                library = "dmsp-20-300" and what replaces its parts, or all parts
    gas = "Isothermal"                          optional; polytropic otherwise
    [plant.circuit]                             model = "FillDischarge" with supply, fill and discharge
    [plant.mechanism]                           model = "HangingMass", mass = "5 kg"
    [command]                                   see command_table.py; with a controller, loop_table.py
    fill = [["5 s", 1], ["15 s", 0]]            every input of the plant: instants, and the value from then on
    [run]
    duration = "25 s"
    output = "10 ms"                            optional
    start = { pressure = "0 bar" }              optional: rest at this pressure; or a state, position = "10 mm"
    method = { model = "Rodas4", rtol = 1e-8 }  optional
    [output]
    columns = ["pressure", "force"]             optional: what the file of the run holds beside the time; or all

Components are tables with `model` and their parameters; later components need no new grammar.
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
from ..control.driver import WithDrivers
from ..control.inputs import InputSignal
from ..core.errors import ParameterError, suggestion
from ..library.build import build
from ..library.catalogue import load, read_toml
from ..library.entry import Entry
from ..library.location import Location, check_keys, check_type, read_finite_number, located_errors, read_text
from ..muscle import Muscle
from ..plant.plant import Plant
from ..recording import Recording
from ..simulation.arguments import check_input_range
from ..simulation.integrators import Integrator, Rodas4
from ..simulation.simulate import simulate
from .controller import build_control_loop, signal_units
from .inputs import build_input_signal

TABLES = ("title", "plant", "command", "run", "output")
RUN = ("duration", "start_time", "output", "start", "method")
OUTPUT = ("columns",)
DEFAULT_START: Mapping[str, Any] = MappingProxyType({"pressure": 0.0})
"""A run begins at rest at ambient pressure unless it says otherwise."""


@dataclasses.dataclass(frozen=True)
class Scenario:
    """A plant, what it is commanded, and how long it runs; all numbers SI."""

    title: str
    plant: Plant
    command: InputSignal | ControlLoop
    duration: float
    start: dict[str, float]
    start_time: float = 0.0
    output: float | None = None
    method: Integrator = dataclasses.field(default_factory=Rodas4)
    columns: tuple[str, ...] = ()
    """What the file of the run holds beside the time; empty: everything."""

    def simulate(self, *, complete: bool = True) -> Recording:
        """The run as a Recording; see `airmuscle.simulate`."""
        return simulate(
            self.plant,
            self.command,
            duration=self.duration,
            start=self.start,
            start_time=self.start_time,
            method=self.method,
            output=self.output,
            complete=complete,
        )

    def select_columns(self, recording: Recording) -> Recording:
        """The recording with the columns that the scenario asks for."""
        kept = {name: recording[name] for name in recording if not self.columns or name in ("time", *self.columns)}
        return dataclasses.replace(recording, columns=kept)


def load_scenario(path: str | Path) -> Scenario:
    """The scenario in a file. Raises FileError, ParameterError, UnitError or UnknownName, saying where."""
    file = Path(path)
    return build_scenario(read_toml(file), Location(str(file), "", file.parent))


def build_scenario(
    tables: Mapping[str, Any], place: Location, plant: Plant | None = None, rest: dict[str, float] | None = None
) -> Scenario:
    """The scenario that the tables of a file describe; a `plant` that is given stands for the table [plant], and a
    `rest` for the equilibrium that the run begins at."""
    check_keys(tables, TABLES, place)
    for key in ("plant", "run"):
        _table(tables.get(key), key, place)
    plant = plant or _plant(tables["plant"], place.inside("plant"))
    run, at = tables["run"], place.inside("run")
    check_keys(run, RUN, at)
    if "duration" not in run:
        raise ParameterError(f"{at}: 'duration' is missing; write it like duration = \"25 s\".")
    duration, start_time = (
        _read_duration(run, "duration", at),
        read_finite_number(run.get("start_time", 0.0), "s", f"{at}, start_time"),
    )
    table = _table(tables.get("command", {}), "command", place)
    start = _start(run.get("start", DEFAULT_START), plant, at.inside("start"), rest)
    command = _command(table, plant, start, duration, place.inside("command"))
    shown = WithDrivers(command.other_inputs, command.drivers) if isinstance(command, ControlLoop) else command
    with located_errors(place.inside("command")):
        check_input_range(plant, shown.segments(plant.inputs, start_time, duration), start_time)
    known = list(column_units(plant, start, command))
    return Scenario(
        title=read_text(tables, "title", place, needed=False) or Path(place.file).stem,
        plant=plant,
        command=command,
        duration=duration,
        start=start,
        start_time=start_time,
        output=_read_duration(run, "output", at) if "output" in run else None,
        method=_build_model(run["method"], Integrator, at.inside("method")) if "method" in run else Rodas4(),
        columns=_columns(_table(tables.get("output", {}), "output", place), known, place.inside("output")),
    )


def _table(given: Any, key: str, place: Location) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        what = "is missing" if given is None else f"is {given!r}, no table; write [{key}] and its keys under it"
        raise ParameterError(f"{place}: the table [{key}] {what}.")
    return given


def _command(
    table: Mapping[str, Any], plant: Plant, start: Mapping[str, float], duration: float, place: Location
) -> InputSignal | ControlLoop:
    if "controller" not in table:
        return build_input_signal(table, plant.commands, place)
    loop = build_control_loop(table, plant, signal_units(plant, start), place)
    with located_errors(place.inside("controller")):
        loop.check_period(duration)
    return loop


def column_units(plant: Plant, start: Mapping[str, float], command: InputSignal | ControlLoop) -> dict[str, str]:
    """The units of all columns that a run has; '' where none is known."""
    units = {"time": "s"} | signal_units(plant, start)
    return units | (command.units(units) if isinstance(command, ControlLoop) else {})


def _read_duration(table: Mapping[str, Any], key: str, place: Location) -> float:
    """A length of time [s]."""
    found = read_finite_number(table[key], "s", f"{place}, {key}")
    if not found > 0:
        raise ParameterError(f"{place}, {key} is {table[key]!r}; it must be greater than zero.")
    return found


def _plant(table: Mapping[str, Any], place: Location) -> Plant:
    muscles = table.get("muscle")
    if muscles is None:
        raise ParameterError(f"{place}: 'muscle' is missing; name a library entry, a file, or write [plant.muscle].")
    found: Any
    if isinstance(muscles, list):
        found = tuple(_muscle(m, place.inside(f"muscle[{i}]")) for i, m in enumerate(muscles))
    else:
        found = _muscle(muscles, place.inside("muscle"))
    rest = {"model": "Plant", **{key: value for key, value in table.items() if key != "muscle"}}
    plant: Plant = check_type(build(rest, place, {"muscle": found}), Plant, place)
    return plant


def _muscle(given: Any, place: Location) -> Any:
    if isinstance(given, Mapping):
        rest = {"model": "Muscle", **given}
        base = rest.pop("library", None)
        return build(
            rest, place, {} if base is None else _entry_parts(_entry(base, place.inside("library")), rest, place)
        )
    entry = _entry(given, place)
    with located_errors(place):
        return entry.muscle


def _entry(given: Any, place: Location) -> Entry:
    if not isinstance(given, str):
        raise ParameterError(f"{place} is {given!r}; name a library entry or a muscle file.")
    with located_errors(place):
        return load(place.folder / given if given.endswith(".toml") else given)


def _entry_parts(entry: Entry, replaced: Mapping[str, Any], place: Location) -> dict[str, Any]:
    """The parts of an entry that a table leaves as they are; what it lacks, such as a geometry, the table may give."""
    names = [f.name for f in dataclasses.fields(Muscle) if f.name not in ("contractile", "name")]
    parts = {"contractile": entry.characteristic, **{name: getattr(entry, name, None) for name in names}}
    if "contractile" in replaced:
        del parts["validity_range"]  # it tells where the law that is replaced was measured
    left = {name: part for name, part in parts.items() if part is not None and name not in replaced}
    if not isinstance(left.get("contractile"), ForceLaw | NoneType):
        raise ParameterError(
            f"{place}: {entry.name} is {type(entry.characteristic).__name__}, which is not solved for the force; "
            "a plant needs a ForceLaw. In Python, as_force_law(law, validity range) makes one."
        )
    return left


def initial_pressure(tables: Mapping[str, Any], place: Location) -> float | None:
    """Gauge pressure [Pa] in the muscles where a run begins at rest; None where it begins at another state."""
    given = tables["run"].get("start", DEFAULT_START)
    if not isinstance(given, Mapping) or set(given) - {"pressure"}:
        return None
    return read_finite_number(given.get("pressure", 0.0), "Pa", f"{place.inside('run').inside('start')}, pressure")


def _start(given: Any, plant: Plant, place: Location, rest: dict[str, float] | None) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise ParameterError(f'{place} is {given!r}; write start = {{ pressure = "0 bar" }}.')
    coordinates = {
        name: unit for c in plant.mechanism.coordinates for name, unit in ((c.name, c.unit), (c.speed, f"{c.unit}/s"))
    }
    kinds = {"pressure": "Pa", **coordinates}
    check_keys(given, tuple(kinds), place)
    values = {key: read_finite_number(value, kinds[key], f"{place}, {key}") for key, value in given.items()}
    pressure = values.pop("pressure", 0.0)
    with located_errors(place):
        if values:
            return plant.state_at(pressure=pressure, **values)
        return find_equilibrium(plant, pressure=pressure) if rest is None else rest


def _columns(table: Mapping[str, Any], known: Sequence[str], place: Location) -> tuple[str, ...]:
    check_keys(table, OUTPUT, place)
    given = table.get("columns", [])
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
        raise ParameterError(f'{place}, columns is {given!r}; write columns = ["pressure", "force"].')
    for name in given:
        if name not in known:
            raise ParameterError(
                f"{place}: the run has no column '{name}'; there are {', '.join(known)}.{suggestion(name, known)}"
            )
    return tuple(given)


def _build_model(given: Any, kind: type[Any], place: Location) -> Any:
    return check_type(build({"model": given} if isinstance(given, str) else given, place), kind, place)


build_plant, build_muscle = _plant, _muscle
"""The grammar of a plant and of a muscle, for other files that hold them."""
