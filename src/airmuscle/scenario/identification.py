"""A dynamic fit written down as a file: the plant, the records, and what shall be found.

[plant]                                     as in a scenario, with the numbers that the search starts from;
[command]                                   as in a scenario; of every record that states none of its own
fill = [["0.1 s", 1], ["1 s", 0]]
[observed]                                  what was measured, each with its sensor's standard deviation
pressure = "500 Pa"
position = { deviation = "50 um", column = "height" }      where the file's column has another name
                                            (in SI, or with its unit, height [mm])
[fit]
free = ["muscle.damper.damping", ["circuit.fill.conductance", "circuit.discharge.conductance"]]
                                            shared by all records; a list in it shares one value
own = ["circuit.supply.pressure"]           optional: found for every record
start_time = "50 ms"                        optional: when a run began is unknown within this margin
start = { pressure = "3 kPa" }              optional: so are values that a start takes as known
starts = 8                                  optional, and seed: how many starts the search has
method = { model = "Rodas4", rtol = 1e-8 }  optional
[fit.bounds]                                optional, by the first path; those declared otherwise
"gas.exponent" = [1.01, 1.4]
[[record]]
file = "fill1.csv"                          beside this file
start = { pressure = "0 bar" }              optional: rest at this pressure, or a state with position = "10 mm";
                                            without it, rest at the pressure of the first rows
start_time = "0.2 s"                        optional: where the command's zero stands on the record's clock
first = "0 s"                               optional, and last: the part of the record that is used
mapping = "rig.toml"                        optional, and resting_length: what the file does not say
[record.command]                            optional: this record's own
[record.plant.mechanism]                    optional: parts of the plant that differ in this record
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core import tree
from ..core.errors import ParameterError
from ..identify.dynamic import DynamicFit, Experiment, InitialConditions, InitialValue, StartTime, fit_dynamic
from ..identify.dynamic.experiment import ParameterPaths, RecordUnknown
from ..library.build import build
from ..library.catalogue import parsed
from ..library.location import Location, check_keys, checked, finite, located_errors, text
from ..library.write import scenario_toml
from ..plant.plant import Plant
from ..recording import Recording, read
from ..recording.columns import quantity_of
from ..simulation.arguments import check_input_range
from ..simulation.integrators import Integrator
from .inputs import command_from
from .scenario import plant_from

_TABLES = ("title", "plant", "command", "observed", "fit", "record")
_FIT = ("free", "own", "start_time", "start", "starts", "seed", "method", "bounds")
_RECORD = ("file", "start", "start_time", "first", "last", "mapping", "resting_length", "command", "plant")
FIRST_ROWS = 3
"""Rows whose median pressure is the start where none is stated (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicStudy:
    """Records, their plant, and what is to be found; all numbers SI."""

    title: str
    plant: Plant
    experiments: tuple[Experiment, ...]
    commands: tuple[Mapping[str, Any], ...]
    """The command of every record as its file states it, to be written again."""
    observed: Mapping[str, float]
    free: tuple[ParameterPaths, ...]
    own: tuple[RecordUnknown, ...] = ()
    bounds: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    starts: int = 1
    seed: int = 0
    method: Integrator | None = None

    def fit(self) -> DynamicFit:
        """The numbers found; see `identify.dynamic.fit_dynamic`."""
        return fit_dynamic(
            self.plant, self.experiments, free=self.free, observed=self.observed, per_record=self.own, bounds=self.bounds,
            starts=self.starts, seed=self.seed, method=self.method,
        )  # fmt: skip

    def scenario(self, found: DynamicFit, record: int = 0) -> str:
        """The text of a scenario: a record's plant with what was found, its command, its start and its length."""
        plant, origin = found.plant(record), self.experiments[record].recording.origin
        note = f"{self.title}: numbers found from {', '.join(e.recording.origin for e in self.experiments)}."
        assert isinstance(plant, Plant)
        course = found.problem.record_models[record]
        known = dict(course.experiment.initial_conditions.known)
        for k in course.unknown_indices:
            what = course.unknowns[k].target
            if isinstance(what, InitialValue):
                known[what.name] = float(found.values[k])
        coordinates = plant.mechanism.coordinates
        held = {name for c in coordinates for name in (c.name, c.speed) if c.name in known}
        start = {name: value for name, value in known.items() if name == "pressure" or name in held}
        duration = float(course.times[-1]) - course.start_time(found.values)
        run = {"duration": duration, "start": start}
        return scenario_toml(f"{self.title}, {origin}", plant, self.commands[record], run, note)


def load_study(path: str | Path) -> DynamicStudy:
    """The study in a file. Raises FileError, ParameterError, UnitError, UnknownName or ColumnError, saying where."""
    file = Path(path)
    tables = parsed(file)
    place = Location(str(file), "", file.parent)
    check_keys(tables, _TABLES, place)
    plant = plant_from(_table(tables, "plant", place), place.inside("plant"))
    observed = _observed(_table(tables, "observed", place), plant, place.inside("observed"))
    records = tables.get("record")
    if not isinstance(records, list) or not records:
        raise ParameterError(f'{place}: no record; write [[record]] and file = "fill.csv" under it, once for each.')
    read_so_far = [
        _Record(row, place.inside(f"record {i}"), tables, plant).experiment(observed)
        for i, row in enumerate(records, 1)
    ]
    wanted, at = _table(tables, "fit", place), place.inside("fit")
    check_keys(wanted, _FIT, at)
    return DynamicStudy(
        title=text(tables, "title", place, needed=False) or file.stem,
        plant=plant,
        experiments=tuple(experiment for experiment, _ in read_so_far),
        commands=tuple(command for _, command in read_so_far),
        observed={name: deviation for name, (deviation, _) in observed.items()},
        free=tuple(_shared(item, f"{at}, free") for item in _list(wanted, "free", at)),
        own=_own(wanted, plant, at),
        bounds=_bounds(_table(wanted, "bounds", at, needed=False), plant, at.inside("bounds")),
        starts=_whole(wanted, "starts", 1, at),
        seed=_whole(wanted, "seed", 0, at),
        method=_method(wanted, at),
    )  # fmt: skip


def _table(tables: Mapping[str, Any], key: str, place: Location, *, needed: bool = True) -> Mapping[str, Any]:
    found = tables.get(key, None if needed else {})
    if not isinstance(found, Mapping):
        what = "is missing" if found is None else f"is {found!r}, no table"
        raise ParameterError(f"{place}: the table [{key}] {what}.")
    return found


def _list(table: Mapping[str, Any], key: str, place: Location) -> list[Any]:
    found = table.get(key, [])
    if not isinstance(found, list):
        raise ParameterError(f'{place}, {key} is {found!r}; write a list of paths, ["circuit.fill.conductance"].')
    return found


def _whole(table: Mapping[str, Any], key: str, least: int, place: Location) -> int:
    found = table.get(key, least)
    if isinstance(found, bool) or not isinstance(found, int) or found < least:
        raise ParameterError(f"{place}, {key} is {found!r}; it must be a whole number, {least} or more.")
    return found


def _method(table: Mapping[str, Any], place: Location) -> Integrator | None:
    given = table.get("method")
    if given is None:
        return None
    at = place.inside("method")
    found: Integrator = checked(build({"model": given} if isinstance(given, str) else given, at), Integrator, at)
    return found


def _known_unit(name: str, plant: Plant) -> str | None:
    quantity = quantity_of(name)
    return quantity.unit if quantity else next((s.unit for s in plant.states if s.name == name), None)


def _unit(name: str, plant: Plant) -> str:
    return _known_unit(name, plant) or "1"


def _observed(table: Mapping[str, Any], plant: Plant, place: Location) -> dict[str, tuple[float, str]]:
    """Standard deviation and column of every output that was measured."""
    found = {}
    for name, given in table.items():
        entry = given if isinstance(given, Mapping) else {"deviation": given}
        check_keys(entry, ("deviation", "column"), place.inside(name))
        deviation = finite(entry.get("deviation"), _unit(name, plant), f"{place}, {name}")
        if not deviation > 0:
            raise ParameterError(f"{place}, {name} is {deviation:g}; a sensor's standard deviation is above zero.")
        found[name] = deviation, text(entry, "column", place.inside(name), needed=False) or name
    if not found:
        raise ParameterError(f'{place}: nothing is observed; write pressure = "500 Pa", its sensor\'s deviation.')
    return found


def _shared(given: Any, where: str) -> ParameterPaths:
    if isinstance(given, str):
        return given
    if isinstance(given, list) and given and all(isinstance(path, str) for path in given):
        return tuple(given)
    raise ParameterError(f"{where} holds {given!r}; each is a path in quotes, or a list of paths that share a value.")


def _own(table: Mapping[str, Any], plant: Plant, place: Location) -> tuple[RecordUnknown, ...]:
    found: list[RecordUnknown] = [_shared(item, f"{place}, own") for item in _list(table, "own", place)]
    if "start_time" in table:
        found.append(StartTime(_positive(table["start_time"], "s", f"{place}, start_time")))
    for name, margin in _table(table, "start", place, needed=False).items():
        found.append(InitialValue(name, _positive(margin, _unit(name, plant), f"{place}, start, {name}")))
    return tuple(found)


def _positive(given: Any, unit: str, where: str) -> float:
    found = finite(given, unit, where)
    if not found > 0:
        raise ParameterError(f"{where} is {given!r}; it must be greater than zero.")
    return found


def _bounds(table: Mapping[str, Any], plant: Plant, place: Location) -> dict[str, tuple[float, float]]:
    declared = {leaf.path: leaf.declared for leaf in tree.leaves(plant)}
    found = {}
    for path, given in table.items():
        check_keys({path: given}, tuple(declared), place)
        if not isinstance(given, list) or len(given) != 2:
            raise ParameterError(f"{place}, {path} is {given!r}; write the least and the greatest value, [1.01, 1.4].")
        low, high = (finite(end, declared[path].unit, f"{place}, {path}") for end in given)
        least, greatest = declared[path].bounds
        if low < least or high > greatest:
            raise ParameterError(f"{place}, {path} is {given!r}; allowed are {least:g} to {greatest:g}.")
        if not low < high:
            raise ParameterError(f"{place}, {path} is {given!r}; the least value must lie below the greatest.")
        found[path] = low, high
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class _Record:
    """One [[record]] of a file, and what of the file it shares."""

    row: Any
    place: Location
    tables: Mapping[str, Any]
    shared: Plant

    def experiment(self, observed: Mapping[str, tuple[float, str]]) -> tuple[Experiment, Mapping[str, Any]]:
        """The record as an experiment, and its command as written."""
        if not isinstance(self.row, Mapping):
            raise ParameterError(f"{self.place} is {self.row!r}; write [[record]] and its keys under it.")
        check_keys(self.row, _RECORD, self.place)
        plant = self.plant()
        table = dict(_table({**self.tables, **self.row}, "command", self.place, needed=False))
        if "file" in table:  # so that it can be written elsewhere
            table["file"] = str((self.place.folder / str(table["file"])).resolve())
        recording, at = self.recording(observed), self.place.inside("command")
        start_time = finite(self.row.get("start_time", 0.0), "s", f"{self.place}, start_time")
        command = command_from(table, plant.commands, at)
        with located_errors(at):
            length = max(float(recording["time"][-1]) - start_time, 1e-9)
            check_input_range(plant, command.segments(plant.inputs, 0.0, length), 0.0)
        return Experiment(recording, command, self.start(plant, recording), start_time, plant), table

    def plant(self) -> Plant:
        """The shared plant, with the parts that this record states put in their place."""
        other = _table(self.row, "plant", self.place, needed=False)
        return plant_from({**self.tables["plant"], **other}, self.place.inside("plant")) if other else self.shared

    def recording(self, observed: Mapping[str, tuple[float, str]]) -> Recording:
        """The part of the file that is used, with the observed columns under the names of the outputs."""
        name = text(self.row, "file", self.place, needed=True)
        told = {key: self.row[key] for key in ("mapping", "resting_length") if key in self.row}
        if "mapping" in told:
            told["mapping"] = self.place.folder / told["mapping"]
        with located_errors(self.place):
            found = read(self.place.folder / name, **told)
            if len(found) != 1:
                raise ParameterError(f"{name} holds {len(found)} runs; give a file for each record.")
            taken = {name: (column, _known_unit(name, self.shared)) for name, (_, column) in observed.items()}
            whole = found[0].with_columns(**{name: found[0].in_unit(*column) for name, column in taken.items()})
            return self.cut(whole)

    def cut(self, recording: Recording) -> Recording:
        """The rows from `first` to `last`."""
        ends = [finite(self.row[key], "s", f"{self.place}, {key}") if key in self.row else other
                for key, other in (("first", -np.inf), ("last", np.inf))]  # fmt: skip
        rows = (recording["time"] >= ends[0]) & (recording["time"] <= ends[1])
        if not rows.any():
            raise ParameterError(
                f"{recording.origin}: no row lies between first and last, {ends[0]:g} and {ends[1]:g} s."
            )
        return recording.rows(rows)

    def start(self, plant: Plant, recording: Recording) -> InitialConditions:
        """Rest at a pressure, or the state that is stated."""
        at = self.place.inside("start")
        given = dict(_table(self.row, "start", self.place, needed=False))
        values = {name: finite(value, _unit(name, plant), f"{at}, {name}") for name, value in given.items()}
        sensed = [name for name in recording if name.rpartition(".")[2] == "pressure"]
        usual = float(np.median(recording[sensed[0]][:FIRST_ROWS])) if sensed else 0.0
        pressure = values.pop("pressure", usual)
        with located_errors(at):
            return (
                InitialConditions.at_coordinates(plant, pressure, **values)
                if values
                else InitialConditions.at_rest(plant, pressure)
            )
