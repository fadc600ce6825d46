"""Files of the library: completion of names, reading of TOML, and locations in a file for error
messages.
"""

import contextlib
import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...bench.readers.tables.file_kind import read_toml as read_toml_file
from ...core import (
    AirmuscleError,
    FileError,
    ParameterError,
    UnknownNameError,
    abridged,
    one_line,
    suggestion,
    units,
)
from ...core.errors import check_known, listed
from .folders import LAWS, list_laws


@dataclasses.dataclass(frozen=True)
class Location:
    """Location of a table in a file, or of the value of a `key`, for messages; data files are
    relative to `folder`.
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
        return dataclasses.replace(
            self, table=".".join(filter(None, (self.table, self.key, key))), key=""
        )

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
    check_known(f"{location}: unknown key", map(one_line, table), known)


def read_table(value: Any, known: Any, where: object, remedy: str = "") -> Mapping[str, Any]:
    """A table as it is. Raises ParameterError for anything else; `remedy` is what the message says
    of its contents.
    """
    if not isinstance(value, Mapping):
        raise ParameterError(f"{where} is {abridged(value)}; it must be a table{remedy}.")
    return value


def read_number(value: Any, unit: str, where: object, about: str = "") -> float:
    """Number [SI] of a number in `unit` or a text. Raises ParameterError, which ends with `about`,
    or UnitError.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        expected = "a number" if unit == "1" else f"a number in {unit}"
        raise ParameterError(
            f"{where} is {abridged(value)}; it must be {expected}, or a text with a unit{about}."
        )
    return units.quantity(value, unit, where=str(where))


def read_finite_number(value: Any, unit: str, where: object) -> float:
    """Finite number in SI units, as `read_number`. Raises ParameterError for inf and nan, which
    TOML allows.
    """
    number = read_number(value, unit, where)
    if not math.isfinite(number):
        raise ParameterError(f"{where} is {abridged(value)}; it must be finite.")
    return number


def read_text(table: Mapping[str, Any], key: str, location: Location, *, needed: bool) -> str:
    """Text under a key; empty if the key is missing and not needed. Raises ParameterError."""
    value = table.get(key, "")
    if not isinstance(value, str):
        raise ParameterError(
            f"{location}: {key} is {abridged(value)}; it must be a text in quotes."
        )
    if needed and not value.strip():
        raise ParameterError(f"{location}: '{key}' is missing; it must be a text in quotes.")
    return value


MAX_NAME = 255
"""Maximum length of a name in a file system; the question whether a longer one exists is an
error.
"""


def entries_of_product(name: str) -> tuple[str, ...]:
    """Names of the muscles and laws of the library that were measured on a product, sorted."""
    return tuple(law for law, product in products_of_laws().items() if product == name)


def products_of_laws() -> dict[str, str]:
    """The product on which each muscle or law of the library was measured, by its name; empty where
    none is stated.
    """
    return {law: str(read_toml(LAWS / f"{law}.toml").get("product", "")) for law in list_laws()}


def complete_name(name: str, known: Iterable[str], kind: str) -> str:
    """The known name that equals or uniquely begins with `name`, in any case and with blanks or "_"
    for "-".

    Raises UnknownNameError, listing the known names and suggesting a similar one, or those that
    contain `name`.
    """
    known = tuple(known)
    if name in known:
        return name
    folded = "-".join(name.lower().replace("_", " ").split())  # the spelling of the library
    if folded in known:
        return folded
    matches = [candidate for candidate in known if folded and candidate.lower().startswith(folded)]
    if len(matches) > 1:
        raise UnknownNameError(
            f"'{one_line(name)}' is ambiguous: {', '.join(matches)}. Write more of the name."
        )
    if not matches:
        words = [word for word in (folded, *folded.split("-")) if len(word) > 2]
        similar = list(
            dict.fromkeys(name for word in words for name in known if word in name.lower())
        )[:3]
        containing = f" Did you mean {' or '.join(map(repr, similar))}?" if similar else ""
        hint = _file_in_folder(name) or suggestion(folded, known) or containing
        raise UnknownNameError(f"no {kind} '{one_line(name)}'; there are {listed(known)}.{hint}")
    return matches[0]


def _file_in_folder(name: str) -> str:
    """A sentence with the muscle file or the scenario in a folder of this name; empty if there is
    none.
    """
    files = (Path(name) / file for file in ("muscle.toml", "scenario.toml"))
    file_name = next(
        (file.as_posix() for file in files if 0 < len(name) <= MAX_NAME and file.is_file()), ""
    )
    return f" '{name}' is a folder; write {file_name}." if file_name else ""


def is_path(name_or_path: str | Path) -> bool:
    """Whether the argument is a path: a Path, or text with the suffix .toml or a folder
    separator.
    """
    name = str(name_or_path)
    return isinstance(name_or_path, Path) or name.endswith(".toml") or "/" in name or "\\" in name


def read_toml(path: Path) -> dict[str, Any]:
    """Tables of a TOML file. Raises FileError if the file cannot be read or is not valid TOML."""
    try:
        if "\0" not in str(path) and not path.exists():
            raise FileError(f"{path}: there is no such file.")
        if path.is_dir():
            rest = (
                "; it contains neither muscle.toml nor scenario.toml, which a fit or a campaign"
                " writes."
            )
            raise FileError(
                f"{path}: is a"
                f" folder{_file_in_folder(str(path)).partition(' is a folder')[2] or rest}"
            )
    except OSError as error:  # a name that is too long
        raise FileError(f"{path}: cannot be read ({error.strerror}).") from None
    return read_toml_file(path)
