"""Values in the tables of scenarios, fits and predictions: numbers, also by the names of signals,
and input signals.

Tables of these files are dataclasses, whose fields are declared with `custom_field` and a reader of
this module. What the reader knows is the plant.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...bench.dynamics import InitialValue, ParameterPaths, RecordUnknown, StartTime
from ...bench.readers import read_csv
from ...core import ColumnError, Input, ParameterError, abridged, check_known, tree
from ...engine import Driver, Integrator, SampledSignal, WithDrivers
from ...engine.loop.inputs import NO_INPUT, InputSignal, Periodic, Schedule, check_input_names
from ...physics.plant.plant import Plant
from ...recording.columns import quantity_of, split_unit
from ..library import (
    PLANT_READER,
    Location,
    TableReader,
    check_keys,
    custom_field,
    located_errors,
    model_class,
)
from ..library.files import read_finite_number, read_table, read_text
from .initial_state import PRESSURE, pressure_names

MAX_STARTS = 10_000
MAX_SEED = 2**32 - 1
"""Maximum number of starting points of a search (chosen), and greatest seed."""


@dataclasses.dataclass(frozen=True)
class Number:
    """Reader of a finite number in SI units; a `positive` one is greater than zero."""

    unit: str
    positive: bool = False

    def __call__(self, value: Any, plant: Plant | None, where: object) -> float:
        number = read_finite_number(value, self.unit, where)
        if self.positive and not number > 0:
            raise ParameterError(f"{where} is {abridged(value)}; it must be greater than zero.")
        return number


@dataclasses.dataclass(frozen=True)
class BySignal:
    """Reader of numbers, or pairs (minimum, maximum), by the names of quantities, in `unit` or
    theirs with `per`.
    """

    unit: str | None = None
    per: str = ""
    pairs: bool = False
    positive: bool = False

    def __call__(self, value: Any, plant: Plant, where: Location) -> dict[str, Any]:
        read: dict[str, Any] = {}
        for name, item in read_table(value, plant, where).items():
            number = Number(
                self.unit or f"{signal_unit(name, plant) or '1'}{self.per}", self.positive
            )
            place = where.at(name)
            if self.pairs and (not isinstance(item, list) or len(item) != 2):
                raise ParameterError(
                    f"{place} is {abridged(item)}; it must be a list of minimum and maximum."
                )
            read[name] = (
                tuple(number(e, plant, place) for e in item)
                if self.pairs
                else number(item, plant, place)
            )
        return read


def table_reader(plant: Plant) -> TableReader:
    """The reader of tables whose fields depend on the plant."""
    return dataclasses.replace(PLANT_READER, known=plant)


def optional_table(tables: Mapping[str, Any], key: str, location: Location) -> Mapping[str, Any]:
    """A table inside tables; empty if it is missing. Raises ParameterError if the value is not a
    table.
    """
    return read_table(tables.get(key, {}), None, f"{location}: the table [{key}]")


def required_table(tables: Mapping[str, Any], key: str, location: Location) -> Mapping[str, Any]:
    """A table that must be there. Raises ParameterError."""
    if key not in tables:
        raise ParameterError(f"{location}: the table [{key}] is missing.")
    return optional_table(tables, key, location)


def signal_unit(name: str, plant: Plant) -> str | None:
    """Unit of a quantity or a state of the plant; None if unknown."""
    quantity = quantity_of(name)
    return (
        quantity.unit if quantity else next((s.unit for s in plant.states if s.name == name), None)
    )


def read_observed(table: Any, plant: Plant, where: Location) -> dict[str, tuple[float, str]]:
    """Standard deviation [SI] and column of each measured output. Raises ParameterError or
    UnitError.
    """
    observed = {}
    table = read_table(table, plant, where)
    where = where.inside("")
    for name, value in table.items():
        entry = value if isinstance(value, Mapping) else {"deviation": value}
        check_keys(entry, ("deviation", "column"), where.inside(name))
        number = Number(signal_unit(name, plant) or "1", positive=True)
        column = read_text(entry, "column", where.inside(name), needed=False) or name
        observed[name] = number(entry.get("deviation"), plant, where.at(name)), column
    if not observed:
        raise ParameterError(
            f'{where} is empty; write pressure = "500 Pa", the standard deviation of its sensor.'
        )
    return observed


def read_paths(value: Any, plant: Plant, where: Location) -> tuple[ParameterPaths, ...]:
    """Paths of parameters; an item may also be a list of paths with one common value. Raises
    ParameterError.
    """
    if not isinstance(value, list):
        raise ParameterError(
            f'{where} is {abridged(value)}; it must be a list of paths, such as ["gas.exponent"].'
        )
    known = [leaf.path for leaf in tree.leaves(plant)]
    for item in value:
        paths = item if isinstance(item, list) and item else [item]
        if not all(isinstance(path, str) for path in paths):
            raise ParameterError(
                f"{where} contains {abridged(item)}; each item must be a path in quotes, or a list"
                " of paths with one common value."
            )
        check_known(f"{where}: the plant has no parameter", paths, known, "its parameters are")
    return tuple(tuple(item) if isinstance(item, list) else item for item in value)


def read_bounds(value: Any, plant: Plant, where: Location) -> dict[str, tuple[float, float]]:
    """The bounds of parameters [SI] by path. Raises ParameterError or UnitError."""
    declared = {leaf.path: leaf.declared for leaf in tree.leaves(plant)}
    bounds = {}
    for path, pair in read_table(value, plant, where).items():
        check_keys({path: pair}, tuple(declared), where)
        place = where.at(path)
        if not isinstance(pair, list) or len(pair) != 2:
            raise ParameterError(
                f"{place} is {abridged(pair)}; it must be [minimum, maximum], such as [1.01, 1.4]."
            )
        low, high = (read_finite_number(end, declared[path].unit, place) for end in pair)
        lower, upper = declared[path].bounds
        if low < lower or high > upper:
            raise ParameterError(
                f"{place} is {abridged(pair)}; allowed range: {lower:g} to {upper:g}."
            )
        if not low < high:
            raise ParameterError(
                f"{place} is {abridged(pair)}; the minimum must be less than the maximum."
            )
        bounds[path] = low, high
    return bounds


@dataclasses.dataclass(frozen=True)
class FitTable:
    """Table [fit] of a dynamic fit or, without what concerns the search, of a prediction."""

    free: tuple[ParameterPaths, ...] = custom_field(
        read_paths, "unknowns of all records", default=()
    )
    own: tuple[ParameterPaths, ...] = custom_field(
        read_paths, "unknowns of each record", default=()
    )
    start_time: float | None = custom_field(
        Number("s", positive=True), "margin of the start time", default=None
    )
    initial_state: Mapping[str, float] = custom_field(
        BySignal(positive=True), "margins of initial values", default_factory=dict
    )
    starts: int = 1
    seed: int = 0
    integrator: Integrator | None = None
    bounds: Mapping[str, tuple[float, float]] = custom_field(
        read_bounds, "bounds by path", default_factory=dict
    )

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("starts", self.starts, 1, MAX_STARTS),
            ("seed", self.seed, 0, MAX_SEED),
        ):
            if not low <= value <= high:
                raise ParameterError(
                    f"{name} is {abridged(value)}; allowed range: {low} to {high}."
                )

    def unknowns(self, plant: Plant) -> tuple[RecordUnknown, ...]:
        """The unknowns of each record: parameters, the start time and initial values, within their
        margins.
        """
        unknowns: list[RecordUnknown] = list(self.own)
        if self.start_time is not None:
            unknowns.append(StartTime(self.start_time))
        for name, within in self.initial_state.items():
            unknowns += [
                InitialValue(state, within)
                for state in (pressure_names(plant) if name == PRESSURE else (name,))
            ]
        return tuple(unknowns)


Points = tuple[tuple[float, float], ...]
Chain = Driver | tuple[Driver, ...]


def _read_names(value: Any, plant: Any, where: Location) -> Mapping[str, str]:
    """A table of names."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value.values()):
        raise ParameterError(
            f'{where} is {abridged(value)}; it must be a table such as {{ fill = "valve" }}.'
        )
    return value


def read_drivers(value: Any, plant: Any, where: Location) -> dict[str, Chain]:
    """The drivers of a table by input. Raises ParameterError, UnitError or UnknownNameError."""
    remedy = f'. Write fill = {{ model = "SolenoidDriver" }} in [{where.table}.{where.key}]'
    drivers = read_table(value, plant, where, remedy)
    place = where.inside("")
    chains = {}
    for name, item in drivers.items():
        chains[name] = PLANT_READER.value(item, Chain, place, name)
    return chains


@dataclasses.dataclass(frozen=True)
class SignalTable:
    """Keys of the table of an input signal that are no inputs."""

    model: str | None = None
    period: float | None = custom_field(
        Number("s"), "period after which the signal is repeated", default=None
    )
    file: str | None = None
    columns: Mapping[str, str] | None = custom_field(
        _read_names, "columns of the file by input", default=None
    )
    drivers: Mapping[str, Chain] = custom_field(
        read_drivers, "drivers by input", default_factory=dict
    )


RESERVED_KEYS = tuple(field.name for field in dataclasses.fields(SignalTable))
"""Keys of the table that are not inputs."""


def build_input_signal(
    table: Mapping[str, Any],
    commands: Sequence[Input],
    location: Location,
    unknown_name: str = NO_INPUT,
) -> InputSignal:
    """The input signal of a table; `unknown_name` begins the error message on a name that is not
    among the commands.
    """
    if "controller" in table:
        raise ParameterError(
            f"{location}: only a scenario has a controller; give commanded inputs as rows or a"
            " file."
        )
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
            raise ParameterError(
                f"{location}: '{key}' is given both by the file and by rows; remove one of them."
            )
        points[key] = tuple(_read_rows(value, units[key], location.at(key)))
    name = keys.model or ("SampledSignal" if keys.file is not None else "Schedule")
    with located_errors(location):
        cls = model_class(name, f"{location}, model", kind=Schedule | SampledSignal)
        if not issubclass(cls, Schedule | SampledSignal):
            raise ParameterError(
                f"{location}: {cls.__name__} is no input signal; there are Schedule, SampledSignal."
            )
        signal: InputSignal = cls(points)
        signal = signal if keys.period is None else Periodic(signal, keys.period)
    return WithDrivers(signal, keys.drivers) if keys.drivers else signal


def _read_rows(rows: Any, unit: str, where: Location) -> Iterator[tuple[float, float]]:
    if not isinstance(rows, list):
        raise ParameterError(
            f'{where} is {abridged(rows)}; it must be a list of instants and values, such as [["5'
            ' s", 1], ["15 s", 0]].'
        )
    for row in rows:
        if not (isinstance(row, list) and len(row) == 2):
            text = (
                f"{where} contains {abridged(row)}; each item must be an instant and a value, such"
                ' as ["5 s", 1].'
            )
            raise ParameterError(text)
        yield read_finite_number(row[0], "s", where), read_finite_number(row[1], unit, where)


def _read_file_points(
    keys: SignalTable, rows: Sequence[str], units: Mapping[str, str], location: Location
) -> dict[str, Points]:
    """Points of the inputs that follow a column of a data file; none if no file is named."""
    columns = keys.columns
    inputs = tuple(units)
    if keys.file is None:
        if columns is not None:
            raise ParameterError(
                f'{location}: columns is given without file; write file = "bench.csv" next to it.'
            )
        return {}
    with located_errors(location):
        recording = read_csv(location.folder / keys.file)
        names = recording.names()
        same = {name: name for name in inputs if name in names}
        if columns is None and not same:
            raise ColumnError(
                f"{keys.file} has no column with the name of an input ({', '.join(inputs)}); its"
                " columns are "
                f"{', '.join(recording)}. Write columns = {{ {inputs[0] if inputs else 'fill'} ="
                ' "..." }.'
            )
        columns = same if columns is None else columns
        used = {*columns.values(), *(split_unit(heading)[0] for heading in columns.values()), *rows}
        columns = {**{name: name for name in same if name not in used}, **columns}
        check_input_names(list(columns), inputs)
        values = {name: recording.in_unit(column, units[name]) for name, column in columns.items()}
        signal = SampledSignal.recorded(
            recording.with_columns(**values), {name: name for name in columns}
        )
        return {name: tuple(points) for name, points in signal.points.items()}
