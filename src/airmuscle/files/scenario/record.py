"""Record: one [[record]] of a dynamic fit as an experiment."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ...bench.identify.dynamic import Experiment, stated_ambient
from ...bench.readers import ColumnMapping, read, read_mapping
from ...bench.readers.mapping import mapping_of_tables
from ...core.absolute_pressure import ambient_pressure
from ...core.annotation import abridged
from ...core.errors import ParameterError
from ...engine.run.problem import check_signal
from ...physics.plant.plant import Plant
from ...recording import Recording
from ..library.fields import custom_field
from ..library.location import Location, located_errors
from ..library.plant_file import build_plant
from .initial_state import build_initial_conditions
from .inputs import build_input_signal
from .values import Number, optional_table, read_table, signal_unit, table_reader


def _read_mapping(value: Any, plant: Plant, where: Location) -> ColumnMapping:
    """The mapping of a file, by its name, or of a table."""
    with located_errors(where):
        if isinstance(value, Mapping):
            return mapping_of_tables(value, "mapping")
        if isinstance(value, str):
            return read_mapping(where.folder / value)
    raise ParameterError(f"{where} is {abridged(value)}; it must be the name of a mapping file, or a table.")


@dataclasses.dataclass(frozen=True)
class RecordTable:
    """One [[record]] of a file."""

    file: str = ""
    start_time: float = custom_field(Number("s"), "time of the record at which the input begins", default=0.0)
    initial_state: Mapping[str, Any] = custom_field(read_table, "initial values", default_factory=dict)
    first: float = custom_field(Number("s"), "time of the first row that is used", default=-math.inf)
    last: float = custom_field(Number("s"), "time of the last row that is used", default=math.inf)
    mapping: ColumnMapping = custom_field(_read_mapping, "what the file does not state", default=ColumnMapping())
    resting_length: float | str | None = None
    ambient: float | str | None = None
    input: Mapping[str, Any] | None = custom_field(read_table, "input of this record", default=None)
    plant: Mapping[str, Any] = custom_field(read_table, "parts of the plant that differ", default_factory=dict)


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
        row: RecordTable = table_reader(self.shared).build(self.row, self.location, kind=RecordTable)
        table = dict(optional_table(self.tables, "input", self.location) if row.input is None else row.input)
        if "file" in table:  # absolute, because the table is also written to other folders
            table["file"] = str((self.location.folder / str(table["file"])).resolve())
        in_input = self.location.inside("input")
        recording = self._cut(self._read_recording(row, observed) if self.given is None else self.given, row)
        plant = self._build_plant(recording, row)
        with ambient_pressure(plant.ambient.pressure):
            signal = build_input_signal(table, plant.input_variables, in_input)
            with located_errors(in_input):
                check_signal(plant, signal, 0.0, max(float(recording["time"][-1]) - row.start_time, 1e-9))
            place = self.location.inside("initial_state")
            conditions = build_initial_conditions(row.initial_state, plant, recording, place)
        return Experiment(recording, signal, conditions, row.start_time, plant), table

    def _build_plant(self, recording: Recording, row: RecordTable) -> Plant:
        """The shared plant with the parts that this record replaces, in the ambient air of the recording unless the
        file states another one."""
        tables = {**self.tables["plant"], **row.plant}
        plant = build_plant(tables, self.location.inside("plant")) if row.plant else self.shared
        stated = {} if self.predicted else optional_table(tables, "ambient", self.location.inside("plant"))
        measured = stated_ambient(recording, plant.ambient)
        free = {name: value for name, value in vars(measured).items() if name not in stated}
        ambient = dataclasses.replace(plant.ambient, **free)
        return plant if ambient == plant.ambient else dataclasses.replace(plant, ambient=ambient)

    def _read_recording(self, row: RecordTable, observed: Mapping[str, tuple[float, str]]) -> Recording:
        """The recording of the file, with the observed columns under the names of the outputs."""
        if not row.file.strip():
            raise ParameterError(f"{self.location}: 'file' is missing; it must be a text in quotes.")
        stated = {"resting_length": row.resting_length, "ambient": row.ambient}
        mapping = mapping_of_tables(stated, f"{self.location}", row.mapping)
        with located_errors(self.location):
            runs = read(self.location.folder / row.file, mapping)
            if len(runs) != 1:
                raise ParameterError(f"{row.file} contains {len(runs)} runs; give one file for each record.")
            return with_observed(runs[0], observed, self.shared)

    def _cut(self, recording: Recording, row: RecordTable) -> Recording:
        """The rows from the time `first` to the time `last`."""
        kept = (recording["time"] >= row.first) & (recording["time"] <= row.last)
        if not kept.any():
            raise ParameterError(
                f"{recording.origin}: there is no row between first, {row.first:g} s, and last, {row.last:g} s."
            )
        return recording.rows(kept)


def build_records(
    tables: Mapping[str, Any], shared: Mapping[str, Any], plant: Plant, observed: Mapping[str, tuple[float, str]],
    location: Location, predicted: bool = False,
) -> list[tuple[Experiment, Mapping[str, Any]]]:  # fmt: skip
    """The experiments of all [[record]] of a file, with their tables [input]; `shared` has the plant and the input.

    Raises FileError, ParameterError, UnitError, UnknownNameError or ColumnError with the location.
    """
    rows = tables.get("record")
    if not isinstance(rows, list) or not rows:
        raise ParameterError(f'{location}: no record is given; write [[record]] with file = "fill.csv" for each.')
    return [
        Record(row, location.inside(f"record {i}"), shared, plant, predicted=predicted).build_experiment(observed)
        for i, row in enumerate(rows, 1)
    ]


def with_observed(recording: Recording, observed: Mapping[str, tuple[float, str]], plant: Plant) -> Recording:
    """The recording with the observed columns under the names of the outputs [SI]. Raises ColumnError, UnitError."""
    columns = {name: (column, signal_unit(name, plant)) for name, (_, column) in observed.items()}
    return recording.with_columns(**{name: recording.in_unit(*column) for name, column in columns.items()})
