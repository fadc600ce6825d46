"""Record: one [[record]] of a dynamic fit as an experiment."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...bench.identify.dynamic import Experiment, stated_ambient
from ...bench.readers import read
from ...bench.readers.mapping import mapping_of_tables
from ...core.absolute_pressure import ambient_pressure
from ...core.errors import ParameterError
from ...engine.run.problem import check_signal
from ...physics.plant.plant import Plant
from ...recording import Recording
from ...recording.columns import quantity_of
from ..library.location import Location, check_keys, located_errors, read_finite_number, read_text
from ..library.plant_file import build_plant
from .initial_state import build_initial_conditions
from .inputs import build_input_signal

_OPTIONS = ("mapping", "resting_length", "ambient")
_KEYS = ("file", "initial_state", "start_time", "first", "last", *_OPTIONS, "input", "plant")


@dataclasses.dataclass(frozen=True, eq=False)
class Record:
    """One [[record]] of a file, with the tables and the plant that all records share."""

    row: Any
    location: Location
    tables: Mapping[str, Any]
    shared: Plant
    given: Recording | None = None
    """The recording, if it was read before; then the table needs no file."""
    predicted: bool = False
    """Whether the record is predicted: then its ambient air replaces that of the plant, which was found elsewhere."""

    def build_experiment(self, observed: Mapping[str, tuple[float, str]]) -> tuple[Experiment, Mapping[str, Any]]:
        """The record as an experiment, and its table [input]; `observed` has the column of each output.

        Raises FileError, ParameterError, UnitError, UnknownNameError or ColumnError with the location.
        """
        if not isinstance(self.row, Mapping):
            raise ParameterError(f"{self.location} is {self.row!r}; write [[record]] and its keys under it.")
        check_keys(self.row, _KEYS, self.location)
        table = dict(optional_table({**self.tables, **self.row}, "input", self.location))
        if "file" in table:  # absolute, because the table is also written to other folders
            table["file"] = str((self.location.folder / str(table["file"])).resolve())
        in_input = self.location.inside("input")
        recording = self._read_recording(observed) if self.given is None else self._cut(self.given)
        plant = self._build_plant(recording)
        with ambient_pressure(plant.ambient.pressure):
            start_time = read_finite_number(self.row.get("start_time", 0.0), "s", f"{self.location}, start_time")
            signal = build_input_signal(table, plant.input_variables, in_input)
            with located_errors(in_input):
                duration = max(float(recording["time"][-1]) - start_time, 1e-9)
                check_signal(plant, signal, 0.0, duration)
            initial = optional_table(self.row, "initial_state", self.location)
            conditions = build_initial_conditions(initial, plant, recording, self.location.inside("initial_state"))
        return Experiment(recording, signal, conditions, start_time, plant), table

    def _build_plant(self, recording: Recording) -> Plant:
        """The shared plant with the parts that this record replaces, in the ambient air of the recording unless the
        file states another one."""
        replaced = optional_table(self.row, "plant", self.location)
        tables = {**self.tables["plant"], **replaced}
        plant = build_plant(tables, self.location.inside("plant")) if replaced else self.shared
        stated = {} if self.predicted else optional_table(tables, "ambient", self.location.inside("plant"))
        measured = stated_ambient(recording, plant.ambient)
        free = {name: value for name, value in vars(measured).items() if name not in stated}
        ambient = dataclasses.replace(plant.ambient, **free)
        return plant if ambient == plant.ambient else dataclasses.replace(plant, ambient=ambient)

    def _read_recording(self, observed: Mapping[str, tuple[float, str]]) -> Recording:
        """The used part of the file, with the observed columns under the names of the outputs."""
        name = read_text(self.row, "file", self.location, needed=True)
        options = {key: self.row[key] for key in _OPTIONS if key in self.row}
        with located_errors(self.location):
            if isinstance(options.get("mapping"), Mapping):
                options["mapping"] = mapping_of_tables(options["mapping"], "mapping")
            elif "mapping" in options:
                options["mapping"] = self.location.folder / options["mapping"]
            runs = read(self.location.folder / name, **options)
            if len(runs) != 1:
                raise ParameterError(f"{name} contains {len(runs)} runs; give one file for each record.")
            return self._cut(with_observed(runs[0], observed, self.shared))

    def _cut(self, recording: Recording) -> Recording:
        """The rows from the time `first` to the time `last`."""
        first, last = (
            read_finite_number(self.row[key], "s", f"{self.location}, {key}") if key in self.row else default
            for key, default in (("first", -np.inf), ("last", np.inf))
        )
        rows = (recording["time"] >= first) & (recording["time"] <= last)
        if not rows.any():
            raise ParameterError(
                f"{recording.origin}: there is no row between first, {first:g} s, and last, {last:g} s."
            )
        return recording.rows(rows)


def with_observed(recording: Recording, observed: Mapping[str, tuple[float, str]], plant: Plant) -> Recording:
    """The recording with the observed columns under the names of the outputs [SI]. Raises ColumnError, UnitError."""
    columns = {name: (column, signal_unit(name, plant)) for name, (_, column) in observed.items()}
    return recording.with_columns(**{name: recording.in_unit(*column) for name, column in columns.items()})


def optional_table(tables: Mapping[str, Any], key: str, location: Location) -> Mapping[str, Any]:
    """A table inside tables; empty if it is missing. Raises ParameterError if the value is not a table."""
    table = tables.get(key, {})
    if not isinstance(table, Mapping):
        raise ParameterError(f"{location}: the table [{key}] is {table!r}; it must be a table.")
    return table


def signal_unit(name: str, plant: Plant) -> str | None:
    """Unit of a quantity or a state of the plant; None if unknown."""
    quantity = quantity_of(name)
    return quantity.unit if quantity else next((s.unit for s in plant.states if s.name == name), None)
