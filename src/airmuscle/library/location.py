"""Where in a file something stands, and what every table of a file is refused for."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core import units
from ..core.errors import AirmuscleError, ParameterError, suggestion


@dataclasses.dataclass(frozen=True)
class Location:
    """Where in a file something stands, for messages; and the folder that its data files are relative to."""

    file: str
    table: str
    folder: Path

    def inside(self, key: str) -> Location:
        """The place of a table or list item within this one."""
        return dataclasses.replace(self, table=f"{self.table}.{key}" if self.table else key)

    def __str__(self) -> str:
        return f"{self.file}, [{self.table}]" if self.table else self.file


@contextlib.contextmanager
def located_errors(place: Location | str) -> Iterator[None]:
    """Puts the place in front of the message of any error of ours that is raised inside."""
    try:
        yield
    except AirmuscleError as error:
        raise type(error)(f"{place}: {error}") from None


def check_keys(table: Mapping[str, Any], known: Sequence[str], place: Location) -> None:
    """Raise ParameterError, with the nearest name, for a key that is not among the known ones."""
    for key in table:
        if key not in known:
            raise ParameterError(
                f"{place}: '{key}' is not known here; there are {', '.join(known)}.{suggestion(key, known)}"
            )


def read_number(value: Any, unit: str, where: str, about: str = "") -> float:
    """A number in SI, from a number in `unit` or text with its unit; `about` ends the message on anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        wanted = "a number" if unit == "1" else f"a number in {unit}"
        raise ParameterError(f"{where} is {value!r}; it must be {wanted}, or text with a unit{about}.")
    return units.quantity(value, unit, where=where)


def read_finite_number(value: Any, unit: str, where: str) -> float:
    """As `number`; what is not finite, which a TOML file can hold, is refused."""
    found = read_number(value, unit, where)
    if not math.isfinite(found):
        raise ParameterError(f"{where} is {value}; it must be finite.")
    return found


def read_text(table: Mapping[str, Any], key: str, place: Location, *, needed: bool) -> str:
    """The text under a key, or nothing where it may be missing."""
    value = table.get(key, "")
    if not isinstance(value, str):
        raise ParameterError(f"{place}: {key} is {value!r}; it must be text.")
    if needed and not value.strip():
        raise ParameterError(f"{place}: '{key}' is missing; it must be text.")
    return value


def check_type(found: Any, kind: type[Any], place: Location) -> Any:
    """What was built, if it is of the kind that stands here."""
    if not isinstance(found, kind):
        raise ParameterError(f"{place}: {type(found).__name__} is no {kind.__name__.lower()}.")
    return found
