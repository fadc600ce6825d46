"""The table [command] of a scenario: schedules and signals, from the file itself or from a recording, and drivers.

[command]
fill = [["5 s", 1], ["15 s", 0]]            an input: instants, and the value from then on
model = "SampledSignal"                            optional: straight lines between the points; Schedule otherwise
period = "2 s"                              optional: the first 2 s over and over
file = "bench.csv"                          optional: columns of a data file, Signal unless model says otherwise
columns = { fill = "valve [%]" }            optional: which column an input follows, if not the one of its name
[command.drivers]
fill = { model = "SolenoidDriver", opening_delay = "5 ms" }     optional: one driver, or several in the signal's order
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..control.driver import Driver, SolenoidDriver, WithDrivers
from ..control.inputs import NO_INPUT, InputSignal, Periodic, SampledSignal, Schedule, check_input_names
from ..core.errors import ColumnError, ParameterError
from ..core.variables import Input
from ..library.build import build
from ..library.location import Location, check_keys, checked, finite, located_errors, text
from ..library.models import model_class

KEYS = ("model", "period", "file", "columns", "drivers")
"""Keys of the table that are no inputs."""
Points = tuple[tuple[float, float], ...]


def command_from(
    table: Mapping[str, Any], commands: Sequence[Input], place: Location, lacks: str = NO_INPUT
) -> InputSignal:
    """The command that the table describes. Raises ParameterError, UnitError, UnknownName, FileError or ColumnError;
    `lacks` begins the message about a name that is not among the commands."""
    if "controller" in table:
        raise ParameterError(
            f"{place}: a controller stands in a scenario only; give what was commanded, as rows or a file."
        )
    units = {given.name: given.unit for given in commands}
    inputs = tuple(units)
    rows = {key: value for key, value in table.items() if key not in KEYS}
    with located_errors(place):
        check_input_names(list(rows), inputs, lacks)
    points = _recorded(table, units, place)
    for key, given in rows.items():
        if key in points:
            raise ParameterError(f"{place}: '{key}' stands in the file and here too; take it out of one of them.")
        points[key] = tuple(_point(row, units[key], f"{place}, {key}") for row in _list(given, f"{place}, {key}"))
    with located_errors(place):
        command: InputSignal = _kind(table, place)(points)
    if "period" in table:
        length = finite(table["period"], "s", f"{place}, period")
        with located_errors(place):
            command = Periodic(command, length)
    drivers = drivers_from(table.get("drivers", {}), inputs, place.inside("drivers"))
    return WithDrivers(command, drivers) if drivers else command


def _kind(table: Mapping[str, Any], place: Location) -> type[Schedule] | type[SampledSignal]:
    kind = model_class(table.get("model", "SampledSignal" if "file" in table else "Schedule"), f"{place}, model")
    if not issubclass(kind, Schedule | SampledSignal):
        raise ParameterError(f"{place}: {kind.__name__} is no command; there are Schedule and Signal.")
    return kind


def _list(rows: Any, where: str) -> list[Any]:
    if not isinstance(rows, list):
        raise ParameterError(f'{where} is {rows!r}; write instants and values, [["5 s", 1], ["15 s", 0]].')
    return rows


def _point(row: Any, unit: str, where: str) -> tuple[float, float]:
    if not (isinstance(row, list) and len(row) == 2):
        raise ParameterError(f'{where} holds {row!r}; each is an instant and a value, ["5 s", 1].')
    return finite(row[0], "s", where), finite(row[1], unit, where)


def _recorded(table: Mapping[str, Any], units: Mapping[str, str], place: Location) -> dict[str, Points]:
    """The points of the inputs that follow a column of a data file; none where no file is named."""
    columns, inputs = table.get("columns"), tuple(units)
    if "file" not in table:
        if columns is not None:
            raise ParameterError(f'{place}: columns are named, but no file; write file = "bench.csv" beside them.')
        return {}
    from ..recording import read_csv  # pandas, which no other command needs
    from ..recording.heading import split_unit

    path = text(table, "file", place, needed=True)
    with located_errors(place):
        recording = read_csv(place.folder / path)
        if columns is None:
            named = {*recording, *(split_unit(heading)[0] for heading in recording)}
            columns = {name: name for name in inputs if name in named}
            if not columns:
                raise ColumnError(
                    f"{path} has no column called like an input ({', '.join(inputs)}); there are "
                    f'{", ".join(recording)}. Write columns = {{ {inputs[0] if inputs else "fill"} = "..." }}.'
                )
    if not isinstance(columns, Mapping) or not all(isinstance(column, str) for column in columns.values()):
        raise ParameterError(f'{place}, columns is {columns!r}; write columns = {{ fill = "valve" }}.')
    with located_errors(place):
        check_input_names(list(columns), inputs)
        taken = {name: recording.in_unit(column, units[name]) for name, column in columns.items()}
        signal = SampledSignal.recorded(recording.with_columns(**taken), {name: name for name in columns})
        return {name: tuple(points) for name, points in signal.points.items()}


def drivers_from(table: Any, inputs: Sequence[str], place: Location) -> dict[str, Driver | tuple[Driver, ...]]:
    """The drivers of the inputs that the table [command.drivers] names."""
    if not isinstance(table, Mapping):
        raise ParameterError(
            f'{place} is {table!r}; write [{place.table}] and fill = {{ model = "SolenoidDriver" }} under it.'
        )
    with located_errors(place):
        check_input_names(list(table), inputs)
    return {name: _chain(given, place.inside(name)) for name, given in table.items()}


def _chain(given: Any, place: Location) -> Driver | tuple[Driver, ...]:
    if isinstance(given, list):
        return tuple(_driver(each, place.inside(f"[{i}]")) for i, each in enumerate(given))
    return _driver(given, place)


def _driver(given: Any, place: Location) -> Driver:
    if isinstance(given, Mapping) and "library" in given and "model" not in given:
        check_keys(given, ("library",), place)
        return _of_catalogue(text(given, "library", place, needed=True), place)
    found: Driver = checked(build({"model": given} if isinstance(given, str) else given, place), Driver, place)
    return found


def _of_catalogue(name: str, place: Location) -> SolenoidDriver:
    """The delays of a valve of the catalogue, or of a file beside the scenario; its motion is part of them."""
    from ..library.valve_catalogue import load_valve

    with located_errors(place):
        valve = load_valve(place.folder / name if name.endswith(".toml") else name)
        if valve.response is None:
            raise ParameterError(
                f'{valve.name}: no response is published; write model = "SolenoidDriver" and its opening_delay.'
            )
    return SolenoidDriver(valve.response.opening_delay, valve.response.closing_delay)
