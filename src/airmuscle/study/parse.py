"""From a table of a study to the object that it names: `{ model = "Normal", mean = "10 kg", deviation = "1 kg" }`.

A class declares each of its keys with what reads it, because the unit is not the class's own: it is that of the number
that varies, or of the column that is looked at.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping
from typing import Any

from ..core.errors import ParameterError, UnknownNameError, suggestion
from ..library.location import Location, check_keys, located_errors, read_finite_number

Reader = Callable[[Any, str, str], Any]
"""Reads a value, given the unit at hand and where it stands."""
_NUMBER = re.compile(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def key(read: Reader, meaning: str, **field: Any) -> Any:
    """Declare a key of a table on the field that takes it."""
    return dataclasses.field(metadata={"read": read, "meaning": meaning}, **field)


def quantity(value: Any, unit: str, where: str) -> float:
    """A number in the unit at hand."""
    return read_finite_number(value, unit, where)


def difference(value: Any, unit: str, where: str) -> float:
    """A difference of two such numbers: where the zero of its unit lies does not matter."""
    found = read_finite_number(value, unit, where)
    return (
        found - read_finite_number(_NUMBER.sub("0", value, count=1), unit, where) if isinstance(value, str) else found
    )


def ratio(value: Any, unit: str, where: str) -> float:
    """A number without unit, or in per cent."""
    return read_finite_number(value, "1", where)


def seconds(value: Any, unit: str, where: str) -> float:
    """A time [s]."""
    return read_finite_number(value, "s", where)


def whole(value: Any, unit: str, where: str) -> int:
    """A whole number that is not negative."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ParameterError(f"{where} is {value!r}; it must be a whole number, and not negative.")
    return value


def word(value: Any, unit: str, where: str) -> str:
    """A name."""
    if not isinstance(value, str) or not value:
        raise ParameterError(f"{where} is {value!r}; it must be a name in quotes.")
    return value


def chosen(table: Any, kinds: tuple[type[Any], ...], place: Location, unit: str = "1") -> Any:
    """The object that a table names. Raises ParameterError, UnitError or UnknownName, saying where."""
    names = {kind.__name__: kind for kind in kinds}
    if not isinstance(table, Mapping) or not isinstance(table.get("model"), str):
        raise ParameterError(f"{place} is {table!r}; write a table with a model, one of {', '.join(names)}.")
    if table["model"] not in names:
        near = suggestion(table["model"], names)
        raise UnknownNameError(f"{place}: no model '{table['model']}' here; there are {', '.join(names)}.{near}")
    cls = names[table["model"]]
    fields = {f.name: f for f in dataclasses.fields(cls)}
    check_keys({k: v for k, v in table.items() if k != "model"}, tuple(fields), place)
    for name, field in fields.items():
        if name not in table and field.default is dataclasses.MISSING:
            raise ParameterError(f"{place}: {cls.__name__} needs '{name}' ({field.metadata['meaning']}).")
    values = {
        name: field.metadata["read"](table[name], unit, f"{place}, {name}")
        for name, field in fields.items()
        if name in table
    }
    with located_errors(place):
        return cls(**values)
