"""Tables of a dynamic fit and of a prediction: measured outputs, and unknowns of each record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...bench.identify.dynamic import InitialValue, StartTime
from ...bench.identify.dynamic.experiment import ParameterPaths, RecordUnknown
from ...core.errors import ParameterError
from ...engine.run import Integrator
from ...physics.plant.plant import Plant
from ..library.build import build
from ..library.location import Location, check_keys, check_type, read_finite_number, read_text
from .initial_state import PRESSURE, pressure_names
from .record import optional_table, signal_unit


def required_table(tables: Mapping[str, Any], key: str, location: Location) -> Mapping[str, Any]:
    """A table that must be there. Raises ParameterError."""
    if key not in tables:
        raise ParameterError(f"{location}: the table [{key}] is missing.")
    return optional_table(tables, key, location)


def read_list(table: Mapping[str, Any], key: str, location: Location) -> list[Any]:
    """A list of a table; empty if it is missing. Raises ParameterError."""
    items = table.get(key, [])
    if not isinstance(items, list):
        raise ParameterError(
            f'{location}, {key} is {items!r}; it must be a list of paths, such as ["circuit.fill.conductance"].'
        )
    return items


def read_integer(table: Mapping[str, Any], key: str, minimum: int, location: Location) -> int:
    """An integer of at least `minimum`, which is also its default. Raises ParameterError."""
    value = table.get(key, minimum)
    if isinstance(value, bool) or not isinstance(value, int) or value < minimum:
        raise ParameterError(f"{location}, {key} is {value!r}; it must be an integer of at least {minimum}.")
    return value


def build_method(table: Mapping[str, Any], location: Location) -> Integrator | None:
    """The integrator of a table, by its name or as a table; None if it is missing. Raises ParameterError."""
    value = table.get("integrator")
    if value is None:
        return None
    inner = location.inside("integrator")
    model_table = {"model": value} if isinstance(value, str) else value
    method: Integrator = check_type(build(model_table, inner), Integrator, inner)
    return method


def read_observed(table: Mapping[str, Any], plant: Plant, location: Location) -> dict[str, tuple[float, str]]:
    """Standard deviation [SI] and column of each measured output. Raises ParameterError or UnitError."""
    observed = {}
    for name, value in table.items():
        entry = value if isinstance(value, Mapping) else {"deviation": value}
        check_keys(entry, ("deviation", "column"), location.inside(name))
        deviation = read_finite_number(entry.get("deviation"), signal_unit(name, plant) or "1", f"{location}, {name}")
        if not deviation > 0:
            raise ParameterError(
                f"{location}, {name} is {deviation:g}; the standard deviation of a sensor must be greater than zero."
            )
        observed[name] = deviation, read_text(entry, "column", location.inside(name), needed=False) or name
    if not observed:
        raise ParameterError(
            f'{location}: no output is given; write pressure = "500 Pa", the standard deviation of its sensor.'
        )
    return observed


def read_shared(value: Any, where: str) -> ParameterPaths:
    """The path of a parameter, or paths with one common value. Raises ParameterError."""
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value and all(isinstance(path, str) for path in value):
        return tuple(value)
    raise ParameterError(
        f"{where} contains {value!r}; each item must be a path in quotes, or a list of paths with one common value."
    )


def read_own(table: Mapping[str, Any], plant: Plant, location: Location) -> tuple[RecordUnknown, ...]:
    """The unknowns of each record: parameters, the start time and initial values. Raises ParameterError."""
    own: list[RecordUnknown] = [read_shared(item, f"{location}, own") for item in read_list(table, "own", location)]
    if "start_time" in table:
        own.append(StartTime(read_positive(table["start_time"], "s", f"{location}, start_time")))
    for name, margin in optional_table(table, "initial_state", location).items():
        within = read_positive(margin, signal_unit(name, plant) or "1", f"{location}, initial_state, {name}")
        own += [InitialValue(each, within) for each in (pressure_names(plant) if name == PRESSURE else (name,))]
    return tuple(own)


def read_positive(value: Any, unit: str, where: str) -> float:
    """A positive number in SI units. Raises ParameterError or UnitError."""
    number = read_finite_number(value, unit, where)
    if not number > 0:
        raise ParameterError(f"{where} is {value!r}; it must be greater than zero.")
    return number
