"""Locations in a TOML file for error messages, and the checks of its tables and values."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core import units
from ...core.errors import AirmuscleError, ParameterError, suggestion


@dataclasses.dataclass(frozen=True)
class Location:
    """Location of a table in a file, for error messages; data files are relative to `folder`."""

    file: str
    table: str
    folder: Path

    def inside(self, key: str) -> Location:
        """Location of a table or list item inside this table."""
        return dataclasses.replace(self, table=f"{self.table}.{key}" if self.table else key)

    def __str__(self) -> str:
        return f"{self.file}, [{self.table}]" if self.table else self.file


@contextlib.contextmanager
def located_errors(location: Location | str) -> Iterator[None]:
    """Context that prefixes the message of every AirmuscleError with a location."""
    try:
        yield
    except AirmuscleError as error:
        raise error.located(location) from None


def check_keys(table: Mapping[str, Any], known: Sequence[str], location: Location) -> None:
    """Raise ParameterError for an unknown key, with the most similar known key."""
    for key in table:
        if key not in known:
            raise ParameterError(
                f"{location}: unknown key '{key}'; there are {', '.join(known)}.{suggestion(key, known)}"
            )


def read_number(value: Any, unit: str, where: str, about: str = "") -> float:
    """Number in SI units, from a number in `unit` or a text with a unit; `about` is appended to the error message.

    Raises ParameterError or UnitError.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        expected = "a number" if unit == "1" else f"a number in {unit}"
        raise ParameterError(f"{where} is {value!r}; it must be {expected}, or a text with a unit{about}.")
    return units.quantity(value, unit, where=where)


def read_finite_number(value: Any, unit: str, where: str) -> float:
    """Finite number in SI units, as `read_number`. Raises ParameterError for inf and nan, which TOML allows."""
    number = read_number(value, unit, where)
    if not math.isfinite(number):
        raise ParameterError(f"{where} is {value}; it must be finite.")
    return number


def read_text(table: Mapping[str, Any], key: str, location: Location, *, needed: bool) -> str:
    """Text under a key; empty if the key is missing and not needed. Raises ParameterError."""
    value = table.get(key, "")
    if not isinstance(value, str):
        raise ParameterError(f"{location}: {key} is {value!r}; it must be a text in quotes.")
    if needed and not value.strip():
        raise ParameterError(f"{location}: '{key}' is missing; it must be a text in quotes.")
    return value


def with_article(name: str) -> str:
    """A class name with its indefinite article."""
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def check_type(thing: Any, kind: type[Any], location: Location) -> Any:
    """Return an object if it is an instance of `kind`; otherwise raise ParameterError."""
    if not isinstance(thing, kind):
        raise ParameterError(
            f"{location}: {type(thing).__name__} is not allowed here; {with_article(kind.__name__)} is required."
        )
    return thing


def read_table_array(
    tables: Mapping[str, Any], key: str, location: Location
) -> list[tuple[Mapping[str, Any], Location]]:
    """The tables written as [[key]], each with its location; empty if there are none. Raises ParameterError."""
    rows = tables.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise ParameterError(f"{location}: '{key}' must be an array of tables; write [[{key}]] above each.")
    return [(row, location.inside(f"{key} {i}")) for i, row in enumerate(rows, 1)]
