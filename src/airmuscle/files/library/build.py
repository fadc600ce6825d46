"""Models from TOML tables, and valve entries from TOML files.

A table names its class, `model = "Braid"`, and its fields: numbers in the declared unit or text with a unit
(`"300 mm"`), lists for tuples, tables for nested models. A list may also be a column of a data file, relative to
the folder of the TOML file: `{ file = "data/map.csv", column = "force" }`. An orifice may also be a valve of the
library, `{ library = "matrix-821" }`, or of a valve file, `{ library = "my/valve.toml" }`. A valve file contains model
tables, so that both are read in this module:

    title = "..."                   what it is, and which of its paths
    provenance = "data sheet"       origin of the numbers
    [valve]                         flow law and its parameters; the path to the muscle if the paths differ
    [exhaust]                       optional: the path to the surroundings, if its values differ
    [switching_times]               optional: opening_delay and closing_delay, as published
    [[check]]                       published flows that the law must reproduce
    [[reference]]                   sources
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...core.declaration import check_field, parameters
from ...core.errors import ParameterError
from ...core.units import ABSOLUTE
from ...physics.pneumatics.valve import Orifice
from .entry import Check, issue_warning
from .fields import accepts, check_required, describe_type, item_type, read_parameter
from .files import VALVES, complete_name, is_path, list_valves, read_toml
from .location import Location, check_keys, check_type, located_errors, read_finite_number, read_table_array, read_text
from .models import model_class
from .references import read_references
from .valve_entry import PATHS, SwitchingTimes, ValveEntry

TEXT_KEYS = ("title", "provenance", "note", "warning")
"""Keys of an entry file with a text as value; the first two are required."""
_CHECK_UNITS = {"upstream": ABSOLUTE, "downstream": ABSOLUTE, "flow": "m3/s", "tolerance": "m3/s"}

Reader = Callable[[Any, str, str], Any]
"""Reads the value of a field, given the contextual unit and the location for error messages."""


def custom_field(read: Reader, meaning: str, **field: Any) -> Any:
    """Declare a dataclass field that `read` reads from a file, instead of a parameter with a fixed unit."""
    return dataclasses.field(metadata={"read": read, "meaning": meaning}, **field)


def build(
    table: Mapping[str, Any],
    location: Location,
    given: Mapping[str, Any] | None = None,
    *,
    classes: Mapping[str, type[Any]] | None = None,
    unit: str = "1",
    kind: Any = Any,
) -> Any:
    """The model that a table describes. Raises ParameterError, UnitError or UnknownNameError with the location.

    given    fields that are models already and are not in the table
    classes  the allowed classes by name; by default all registered models
    unit     contextual unit of the fields declared with `custom_field`
    kind     annotation of the place of the model; an unknown name is answered with the models that it allows
    """
    if not isinstance(table, Mapping):
        raise ParameterError(
            f'{location} is {table!r}; it must be a table. Write model = "..." and its parameters in it.'
        )
    if "library" in table and "model" not in table and classes is None:
        return _library_orifice(table, location)
    if not isinstance(table.get("model"), str):
        choice = f"one of {', '.join(classes)}" if classes else 'such as model = "Braid"'
        raise ParameterError(f'{location}: the model is not named; write model = "...", {choice}, and its parameters.')
    cls = model_class(table["model"], f"{location}, model", classes, kind)
    fields = {key: value for key, value in table.items() if key != "model"}
    for key in fields:
        with located_errors(location):
            check_field(cls, key)
    declared = {p.name: p for p in parameters(cls)}
    hints = typing.get_type_hints(cls)
    check_required(cls, {**fields, **(given or {})}, hints, location)
    readers = {f.name: f.metadata["read"] for f in dataclasses.fields(cls) if "read" in f.metadata}
    values = {
        key: readers[key](value, unit, f"{location}, {key}")
        if key in readers
        else read_parameter(value, declared[key], hints[key], location)
        if key in declared
        else _build_part(value, hints[key], key, location)
        for key, value in fields.items()
    }
    with located_errors(location):
        return cls(**values, **(given or {}))


def _build_part(value: Any, hint: Any, key: str, location: Location) -> Any:
    """A structural field: a model, a tuple of models, an integer, a text, true or false."""
    inner = location.inside(key)
    if isinstance(value, Mapping):
        part = build(value, inner, kind=hint)
    elif isinstance(value, list):
        part = tuple(_build_part(v, item_type(hint), f"{key}[{i}]", location) for i, v in enumerate(value))
    elif isinstance(value, str) and not accepts(hint, value):
        part = build({"model": value}, inner, kind=hint)
    else:
        part = value
    if not accepts(hint, part):
        what = type(part).__name__ if dataclasses.is_dataclass(part) else repr(part)
        raise ParameterError(f"{location}: {key} is {what}; it must be {describe_type(hint)}.")
    return part


def _library_orifice(table: Mapping[str, Any], location: Location) -> Orifice:
    """An orifice of a valve of the library or of a valve file, relative to the folder of the TOML file."""
    check_keys(table, ("library", "path"), location)
    name = read_text(table, "library", location, needed=True)
    path = read_text({"path": PATHS[0], **table}, "path", location, needed=True)
    with located_errors(location):
        return load_valve(location.folder / name if name.endswith(".toml") else name).orifice(path)


def load_valve(name_or_path: str | Path) -> ValveEntry:
    """A valve by its name or a unique beginning of it, or a valve file by its path.

    Raises UnknownNameError, FileError, ParameterError or UnitError with the location. A warning of the entry is issued
    as an AirmuscleWarning.
    """
    if is_path(name_or_path):
        path = file = Path(name_or_path)
    else:
        path = VALVES / f"{complete_name(str(name_or_path), list_valves(), 'valve')}.toml"
        file = Path(path.name)
    entry = build_valve_entry(read_toml(path), path.stem, file)
    issue_warning(entry.name, entry.warning, stacklevel=2)
    return entry


def build_valve_entry(tables: Mapping[str, Any], name: str, file: Path) -> ValveEntry:
    """The valve entry of the tables of a file; error messages name `file`. Raises ParameterError or UnitError."""
    location = Location(str(file), "", file.parent)
    check_keys(tables, (*TEXT_KEYS, *PATHS, "switching_times", "check", "reference"), location)
    if "valve" not in tables:
        raise ParameterError(f"{location}: the table [valve] is missing; it names a flow law and its parameters.")
    texts = read_entry_texts(tables, location)
    orifices = {key: _build_orifice(tables[key], location.inside(key)) for key in PATHS if key in tables}
    return ValveEntry(
        name=name,
        **texts,
        **orifices,
        switching_times=_read_switching_times(tables, location.inside("switching_times")),
        checks=tuple(_read_check(*row) for row in read_table_array(tables, "check", location)),
        references=read_references(tables, location),
    )


def read_entry_texts(tables: Mapping[str, Any], location: Location) -> dict[str, Any]:
    """Title, provenance, note and warning of an entry file. Raises ParameterError without one of the first two."""
    return {key: read_text(tables, key, location, needed=key in TEXT_KEYS[:2]) for key in TEXT_KEYS}


def _build_orifice(table: Any, location: Location) -> Any:
    return check_type(build(table, location, kind=Orifice), Orifice, location)


def _read_switching_times(tables: Mapping[str, Any], location: Location) -> SwitchingTimes | None:
    table = tables.get("switching_times", {})
    if not isinstance(table, Mapping):
        raise ParameterError(f'{location} is {table!r}; it must be a table. Write opening_delay = "10 ms" in it.')
    if "switching_times" not in tables:
        return None
    names = tuple(p.name for p in parameters(SwitchingTimes))
    check_keys(table, names, location)
    for name in names:
        if name not in table:
            raise ParameterError(f"{location}: '{name}' is missing; give both {' and '.join(names)}.")
    with located_errors(location):
        return SwitchingTimes(**{name: read_finite_number(table[name], "s", f"{location}, {name}") for name in names})


def _read_check(table: Mapping[str, Any], location: Location) -> Check:
    check_keys(table, (*_CHECK_UNITS, "source"), location)
    for key, unit in _CHECK_UNITS.items():
        if key not in table:
            raise ParameterError(f"{location}: '{key}' is missing; give a number in {unit}, or a text with a unit.")
    values = {key: read_finite_number(table[key], unit, f"{location}, {key}") for key, unit in _CHECK_UNITS.items()}
    conditions = (("upstream", values["upstream"]), ("downstream", values["downstream"]))
    source = read_text(table, "source", location, needed=True)
    return Check("flow", conditions, values["flow"], values["tolerance"], source)
