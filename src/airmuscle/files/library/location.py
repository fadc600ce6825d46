"""Locations in a TOML file for error messages, and the checks of its tables and values."""

import contextlib
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core import AirmuscleError, ParameterError, abridged, one_line, suggestion, units


@dataclasses.dataclass(frozen=True)
class Location:
    """Location of a table in a file, or of the value of a `key` in it, for error messages.

    Data files are relative to `folder`.
    """

    file: str
    table: str
    folder: Path
    key: str = ""

    @classmethod
    def of_file(cls, path: Path) -> "Location":
        """Location of the tables of a file."""
        return cls(str(path), "", path.parent)

    def inside(self, key: str) -> "Location":
        """Location of a table or list item inside this table."""
        return dataclasses.replace(self, table=".".join(filter(None, (self.table, self.key, key))), key="")

    def at(self, key: str) -> "Location":
        """Location of the value of a key of this table."""
        return dataclasses.replace(self, key=f"{self.key}, {key}" if self.key else key)

    def __str__(self) -> str:
        return ", ".join(filter(None, (self.file, self.table and f"[{self.table}]", self.key)))


@contextlib.contextmanager
def located_errors(location: object) -> Iterator[None]:
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
                f"{location}: unknown key '{one_line(key)}'; there are {', '.join(known)}.{suggestion(key, known)}"
            )


def read_number(value: Any, unit: str, where: object, about: str = "") -> float:
    """Number in SI units, from a number in `unit` or a text with a unit; `about` is appended to the error message.

    Raises ParameterError or UnitError.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        expected = "a number" if unit == "1" else f"a number in {unit}"
        raise ParameterError(f"{where} is {abridged(value)}; it must be {expected}, or a text with a unit{about}.")
    return units.quantity(value, unit, where=str(where))


def read_finite_number(value: Any, unit: str, where: object) -> float:
    """Finite number in SI units, as `read_number`. Raises ParameterError for inf and nan, which TOML allows."""
    number = read_number(value, unit, where)
    if not math.isfinite(number):
        raise ParameterError(f"{where} is {abridged(value)}; it must be finite.")
    return number


def read_text(table: Mapping[str, Any], key: str, location: Location, *, needed: bool) -> str:
    """Text under a key; empty if the key is missing and not needed. Raises ParameterError."""
    value = table.get(key, "")
    if not isinstance(value, str):
        raise ParameterError(f"{location}: {key} is {abridged(value)}; it must be a text in quotes.")
    if needed and not value.strip():
        raise ParameterError(f"{location}: '{key}' is missing; it must be a text in quotes.")
    return value


def with_article(name: str) -> str:
    """A class name with its indefinite article."""
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"
