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

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...bench.readers import read_csv
from ...core.errors import ColumnError, ParameterError
from ...core.system import Input
from ...engine.loop.driver import Driver, SolenoidDriver, WithDrivers
from ...engine.loop.inputs import NO_INPUT, InputSignal, Periodic, Schedule, check_input_names
from ...engine.loop.sampled_signal import SampledSignal
from ...recording.heading import split_unit
from ..library.build import build, load_valve
from ..library.location import Location, check_keys, check_type, located_errors, read_finite_number, read_text
from ..library.models import model_class

RESERVED_KEYS = ("model", "period", "file", "columns", "drivers")
"""Keys of the table that are not inputs."""
Points = tuple[tuple[float, float], ...]


def build_input_signal(
    table: Mapping[str, Any], commands: Sequence[Input], location: Location, unknown_name: str = NO_INPUT
) -> InputSignal:
    """The input signal of a table. `unknown_name` begins the error message on a name that is not among the commands.

    Raises ParameterError, UnitError, UnknownNameError, FileError or ColumnError with the location.
    """
    if "controller" in table:
        raise ParameterError(
            f"{location}: a controller is allowed only in a scenario; give the commanded inputs as rows or a file."
        )
    units = {command.name: command.unit for command in commands}
    inputs = tuple(units)
    rows = {key: value for key, value in table.items() if key not in RESERVED_KEYS}
    with located_errors(location):
        check_input_names(list(rows), inputs, unknown_name)
    points = _read_file_points(table, units, location)
    for key, value in rows.items():
        if key in points:
            raise ParameterError(f"{location}: '{key}' is given both by the file and by rows; remove one of them.")
        where = f"{location}, {key}"
        points[key] = tuple(_read_point(row, units[key], where) for row in _read_rows(value, where))
    with located_errors(location):
        signal: InputSignal = _signal_class(table, location)(points)
    if "period" in table:
        period = read_finite_number(table["period"], "s", f"{location}, period")
        with located_errors(location):
            signal = Periodic(signal, period)
    drivers = build_drivers(table.get("drivers", {}), inputs, location.inside("drivers"))
    return WithDrivers(signal, drivers) if drivers else signal


def _signal_class(table: Mapping[str, Any], location: Location) -> type[Schedule] | type[SampledSignal]:
    name = table.get("model", "SampledSignal" if "file" in table else "Schedule")
    cls = model_class(name, f"{location}, model", kind=Schedule | SampledSignal)
    if not issubclass(cls, Schedule | SampledSignal):
        raise ParameterError(
            f"{location}: {cls.__name__} is not an input signal; there are Schedule and SampledSignal."
        )
    return cls


def _read_rows(rows: Any, where: str) -> list[Any]:
    if not isinstance(rows, list):
        raise ParameterError(
            f'{where} is {rows!r}; it must be a list of instants and values, such as [["5 s", 1], ["15 s", 0]].'
        )
    return rows


def _read_point(row: Any, unit: str, where: str) -> tuple[float, float]:
    if not (isinstance(row, list) and len(row) == 2):
        raise ParameterError(f'{where} contains {row!r}; each item must be an instant and a value, such as ["5 s", 1].')
    return read_finite_number(row[0], "s", where), read_finite_number(row[1], unit, where)


def _read_file_points(table: Mapping[str, Any], units: Mapping[str, str], location: Location) -> dict[str, Points]:
    """Points of the inputs that follow a column of a data file; none if no file is named."""
    columns, inputs = table.get("columns"), tuple(units)
    if "file" not in table:
        if columns is not None:
            raise ParameterError(f'{location}: columns is given without file; write file = "bench.csv" next to it.')
        return {}
    path = read_text(table, "file", location, needed=True)
    with located_errors(location):
        recording = read_csv(location.folder / path)
        names = {*recording, *(split_unit(heading)[0] for heading in recording)}
        same = {name: name for name in inputs if name in names}
        if columns is None:
            columns = same
            if not columns:
                raise ColumnError(
                    f"{path} has no column with the name of an input ({', '.join(inputs)}); its columns are "
                    f'{", ".join(recording)}. Write columns = {{ {inputs[0] if inputs else "fill"} = "..." }}.'
                )
    if not isinstance(columns, Mapping) or not all(isinstance(column, str) for column in columns.values()):
        raise ParameterError(f'{location}, columns is {columns!r}; it must be a table such as {{ fill = "valve" }}.')
    used = {*columns.values(), *(split_unit(heading)[0] for heading in columns.values()), *table}
    columns = {**{name: name for name in same if name not in used}, **columns}
    with located_errors(location):
        check_input_names(list(columns), inputs)
        values = {name: recording.in_unit(column, units[name]) for name, column in columns.items()}
        signal = SampledSignal.recorded(recording.with_columns(**values), {name: name for name in columns})
        return {name: tuple(points) for name, points in signal.points.items()}


def build_drivers(table: Any, inputs: Sequence[str], location: Location) -> dict[str, Driver | tuple[Driver, ...]]:
    """The drivers of a table [input.drivers] by input. Raises ParameterError, UnitError or UnknownNameError."""
    if not isinstance(table, Mapping):
        raise ParameterError(
            f'{location} is {table!r}; it must be a table. Write fill = {{ model = "SolenoidDriver" }} in '
            f"[{location.table}]."
        )
    with located_errors(location):
        check_input_names(list(table), inputs)
    return {name: _build_chain(value, location.inside(name)) for name, value in table.items()}


def _build_chain(value: Any, location: Location) -> Driver | tuple[Driver, ...]:
    if isinstance(value, list):
        return tuple(_build_driver(item, location.inside(f"[{i}]")) for i, item in enumerate(value))
    return _build_driver(value, location)


def _build_driver(value: Any, location: Location) -> Driver:
    if isinstance(value, Mapping) and "library" in value and "model" not in value:
        check_keys(value, ("library",), location)
        return _library_driver(read_text(value, "library", location, needed=True), location)
    table = {"model": value} if isinstance(value, str) else value
    driver: Driver = check_type(build(table, location, kind=Driver), Driver, location)
    return driver


def _library_driver(name: str, location: Location) -> SolenoidDriver:
    """Driver with the switching times of a valve of the library or of a valve file, relative to the scenario."""
    with located_errors(location):
        valve = load_valve(location.folder / name if name.endswith(".toml") else name)
        if valve.switching_times is None:
            raise ParameterError(
                f'{valve.name}: no switching times are published; write model = "SolenoidDriver" and its opening_delay.'
            )
    return SolenoidDriver(valve.switching_times.opening_delay, valve.switching_times.closing_delay)
