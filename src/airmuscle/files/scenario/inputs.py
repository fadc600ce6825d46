"""Table [input] of a scenario: input signals from the file or from a recording, and drivers.

[input]
fill = [["5 s", 1], ["15 s", 0]]            an input: instants, and the value from each instant on
model = "SampledSignal"                     optional: linear interpolation between the points; Schedule by default
period = "2 s"                              optional: the first 2 s are repeated
file = "bench.csv"                          optional: columns of a data file; then SampledSignal is the default
columns = { fill = "valve [%]" }            optional: the column of an input, by default the one of the same name
[input.drivers]
fill = { model = "SolenoidDriver", opening_delay = "5 ms" }     optional: one driver, or a list in signal order
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...bench.readers import read_csv
from ...core import ColumnError, Input, ParameterError, abridged
from ...engine.loop import Driver, SampledSignal, WithDrivers
from ...engine.loop.inputs import NO_INPUT, InputSignal, Periodic, Schedule, check_input_names
from ...recording.columns import split_unit
from ..library import PLANT_READER, Location, custom_field, located_errors, model_class, read_finite_number, read_table
from .values import Number

Points = tuple[tuple[float, float], ...]
Chain = Driver | tuple[Driver, ...]


def _read_names(value: Any, plant: Any, where: Location) -> Mapping[str, str]:
    """A table of names."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value.values()):
        raise ParameterError(f'{where} is {abridged(value)}; it must be a table such as {{ fill = "valve" }}.')
    return value


def read_drivers(value: Any, plant: Any, where: Location) -> dict[str, Chain]:
    """The drivers of a table by input. Raises ParameterError, UnitError or UnknownNameError."""
    remedy = f'. Write fill = {{ model = "SolenoidDriver" }} in [{where.table}.{where.key}]'
    drivers, place = read_table(value, plant, where, remedy), where.inside("")
    return {name: PLANT_READER.value(item, Chain, place, name) for name, item in drivers.items()}


@dataclasses.dataclass(frozen=True)
class SignalTable:
    """Keys of the table of an input signal that are no inputs."""

    model: str | None = None
    period: float | None = custom_field(Number("s"), "period after which the signal is repeated", default=None)
    file: str | None = None
    columns: Mapping[str, str] | None = custom_field(_read_names, "columns of the file by input", default=None)
    drivers: Mapping[str, Chain] = custom_field(read_drivers, "drivers by input", default_factory=dict)

    def signal_class(self, location: Location) -> type[Schedule] | type[SampledSignal]:
        """The class of the signal. Raises UnknownNameError or ParameterError."""
        name = self.model or ("SampledSignal" if self.file is not None else "Schedule")
        cls = model_class(name, f"{location}, model", kind=Schedule | SampledSignal)
        if not issubclass(cls, Schedule | SampledSignal):
            raise ParameterError(f"{location}: {cls.__name__} is no input signal; there are Schedule, SampledSignal.")
        return cls


RESERVED_KEYS = tuple(field.name for field in dataclasses.fields(SignalTable))
"""Keys of the table that are not inputs."""


def build_input_signal(
    table: Mapping[str, Any], commands: Sequence[Input], location: Location, unknown_name: str = NO_INPUT
) -> InputSignal:
    """The input signal of a table. `unknown_name` begins the error message on a name that is not among the commands.

    Raises ParameterError, UnitError, UnknownNameError, FileError or ColumnError with the location.
    """
    if "controller" in table:
        raise ParameterError(f"{location}: only a scenario has a controller; give commanded inputs as rows or a file.")
    units = {command.name: command.unit for command in commands}
    rows = {key: value for key, value in table.items() if key not in RESERVED_KEYS}
    stated = {key: value for key, value in table.items() if key in RESERVED_KEYS}
    keys: SignalTable = PLANT_READER.build(stated, location, kind=SignalTable)
    with located_errors(location):
        check_input_names(list(rows), tuple(units), unknown_name)
    with located_errors(location.inside("drivers")):
        check_input_names(list(keys.drivers), tuple(units))
    points = _read_file_points(keys, list(rows), units, location)
    for key, value in rows.items():
        if key in points:
            raise ParameterError(f"{location}: '{key}' is given both by the file and by rows; remove one of them.")
        points[key] = tuple(_read_rows(value, units[key], location.at(key)))
    with located_errors(location):
        signal: InputSignal = keys.signal_class(location)(points)
        signal = signal if keys.period is None else Periodic(signal, keys.period)
    return WithDrivers(signal, keys.drivers) if keys.drivers else signal


def _read_rows(rows: Any, unit: str, where: Location) -> Iterator[tuple[float, float]]:
    if not isinstance(rows, list):
        raise ParameterError(
            f'{where} is {abridged(rows)}; it must be a list of instants and values, such as [["5 s", 1], ["15 s", 0]].'
        )
    for row in rows:
        if not (isinstance(row, list) and len(row) == 2):
            text = f'{where} contains {abridged(row)}; each item must be an instant and a value, such as ["5 s", 1].'
            raise ParameterError(text)
        yield read_finite_number(row[0], "s", where), read_finite_number(row[1], unit, where)


def _read_file_points(
    keys: SignalTable, rows: Sequence[str], units: Mapping[str, str], location: Location
) -> dict[str, Points]:
    """Points of the inputs that follow a column of a data file; none if no file is named."""
    columns, inputs = keys.columns, tuple(units)
    if keys.file is None:
        if columns is not None:
            raise ParameterError(f'{location}: columns is given without file; write file = "bench.csv" next to it.')
        return {}
    with located_errors(location):
        recording = read_csv(location.folder / keys.file)
        names = {*recording, *(split_unit(heading)[0] for heading in recording)}
        same = {name: name for name in inputs if name in names}
        if columns is None and not same:
            raise ColumnError(
                f"{keys.file} has no column with the name of an input ({', '.join(inputs)}); its columns are "
                f'{", ".join(recording)}. Write columns = {{ {inputs[0] if inputs else "fill"} = "..." }}.'
            )
        columns = same if columns is None else columns
        used = {*columns.values(), *(split_unit(heading)[0] for heading in columns.values()), *rows}
        columns = {**{name: name for name in same if name not in used}, **columns}
        check_input_names(list(columns), inputs)
        values = {name: recording.in_unit(column, units[name]) for name, column in columns.items()}
        signal = SampledSignal.recorded(recording.with_columns(**values), {name: name for name in columns})
        return {name: tuple(points) for name, points in signal.points.items()}
