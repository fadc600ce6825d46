"""From a table of a file to the model it describes, and every way in which that can go wrong.

A table names its class, `model = "Braid"`, and gives its fields by name: numbers in the declared unit or text
with a unit (`"300 mm"`), lists for tuples, tables for models inside models. A list may also be a column of a
data file, `{ file = "data/map.csv", column = "force" }`, beside the file that names it. A valve may be one of the
catalogue, `{ library = "matrix-821" }`, or of a file of the same form, `{ library = "my/valve.toml" }`.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..core.declaration import Parameter, check_field, parameters
from ..core.errors import ParameterError
from .location import Location, check_keys, located_errors, number, text
from .models import model_class

Reader = Callable[[Any, str, str], Any]
"""Reads the value of a field, given the contextual unit and the location for error messages."""


def custom_field(read: Reader, meaning: str, **field: Any) -> Any:
    """Declare a dataclass field that `read` reads from a file, instead of a parameter with a fixed unit."""
    return dataclasses.field(metadata={"read": read, "meaning": meaning}, **field)


def build(
    table: Mapping[str, Any],
    place: Location,
    ready: Mapping[str, Any] | None = None,
    *,
    classes: Mapping[str, type[Any]] | None = None,
    unit: str = "1",
) -> Any:
    """The model that a table describes. Raises ParameterError, UnitError or UnknownName, saying where.

    ready    fields that are models already and therefore not in the table
    classes  the allowed classes by name; by default all registered models
    unit     contextual unit of the fields declared with `custom_field`
    """
    if not isinstance(table, Mapping):
        raise ParameterError(f'{place}: {table!r} is not a table; write model = "..." and its parameters under it.')
    if "library" in table and "model" not in table and classes is None:
        return _from_catalogue(table, place)
    if not isinstance(table.get("model"), str):
        choice = f"one of {', '.join(classes)}" if classes else 'such as "Braid"'
        raise ParameterError(
            f'{place}: no model is named; write model = "...", {choice}, and its parameters under it.'
        )
    cls = model_class(table["model"], f"{place}, model", classes)
    given = {key: value for key, value in table.items() if key != "model"}
    for key in given:
        with located_errors(place):
            check_field(cls, key)
    declared = {p.name: p for p in parameters(cls)}
    hints = typing.get_type_hints(cls)
    _check_present(cls, {**given, **(ready or {})}, hints, place)
    readers = {f.name: f.metadata["read"] for f in dataclasses.fields(cls) if "read" in f.metadata}
    values = {
        key: readers[key](value, unit, f"{place}, {key}")
        if key in readers
        else _numbers(value, declared[key], hints[key], place)
        if key in declared
        else _part(value, hints[key], key, place)
        for key, value in given.items()
    }
    with located_errors(place):
        return cls(**values, **(ready or {}))


def _from_catalogue(table: Mapping[str, Any], place: Location) -> Any:
    """A valve of the catalogue, or of a file beside the one that names it."""
    from .valve_catalogue import PATHS, load_valve  # which is built from tables itself

    check_keys(table, ("library", "path"), place)
    name, path = (text({"path": PATHS[0], **table}, key, place, needed=True) for key in ("library", "path"))
    with located_errors(place):
        return load_valve(place.folder / name if name.endswith(".toml") else name).along(path)


def _check_present(cls: type[Any], given: Mapping[str, Any], hints: Mapping[str, Any], place: Location) -> None:
    for field in dataclasses.fields(cls):
        optional = field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING
        if not field.init or optional or field.name in given:
            continue
        what = _describe_field(field, hints[field.name])
        raise ParameterError(f"{place}: {cls.__name__} needs '{field.name}' {what}; it is missing.")


def _describe_field(field: dataclasses.Field[Any], hint: Any) -> str:
    facts = field.metadata
    if "unit" in facts:
        return f"[{facts['unit']}] ({facts['symbol']}, {facts['meaning']})"
    return f"({facts['meaning'] if facts else _words(hint)})"


def _numbers(value: Any, declared: Parameter, hint: Any, place: Location) -> Any:
    """A declared parameter: one number, or a tuple of them where the model has a tuple."""
    where = f"{place}, {declared.name}"
    many = typing.get_origin(hint) is tuple
    if isinstance(value, Mapping) and many:
        return _column(value, where, place.folder)
    if isinstance(value, list) != many:
        wanted = "a list of numbers" if many else "one number"
        raise ParameterError(
            f"{where} is {value!r}; {wanted} in {declared.unit} is wanted ({declared.symbol}, {declared.meaning})."
        )
    if many:
        return tuple(_number(v, declared, f"{where}[{i}]") for i, v in enumerate(value))
    return _number(value, declared, where)


def _number(value: Any, declared: Parameter, where: str) -> float:
    return number(value, declared.unit, where, f" ({declared.symbol}, {declared.meaning})")


def _column(value: Mapping[str, Any], where: str, folder: Path) -> tuple[float, ...]:
    """A column of a data file as a tuple, in the SI unit that recordings keep it in."""
    from ..recording import read_csv  # pandas, which most entries do not need

    if set(value) != {"file", "column"} or not all(isinstance(v, str) for v in value.values()):
        raise ParameterError(f'{where}: a column of a file is written {{ file = "data/map.csv", column = "force" }}.')
    with located_errors(where):
        recording = read_csv(folder / value["file"])
        return tuple(float(v) for v in recording[value["column"]])


def _part(value: Any, hint: Any, key: str, place: Location) -> Any:
    """A field that is structure: a model, a tuple of models, a whole number, a name, true or false."""
    inner = place.inside(key)
    if isinstance(value, Mapping):
        found = build(value, inner)
    elif isinstance(value, list):
        found = tuple(_part(v, _item(hint), f"{key}[{i}]", place) for i, v in enumerate(value))
    elif isinstance(value, str) and not _accepts(hint, value):
        found = build({"model": value}, inner)
    else:
        found = value
    if not _accepts(hint, found):
        what = type(found).__name__ if dataclasses.is_dataclass(found) else repr(found)
        raise ParameterError(f"{place}: {key} is {what}; {_words(hint)} is wanted.")
    return found


def _item(hint: Any) -> Any:
    """What a list under a field may hold, by the field's annotation."""
    options = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)
    return next((typing.get_args(option)[0] for option in options if typing.get_origin(option) is tuple), Any)


def _accepts(hint: Any, value: Any) -> bool:
    """Whether a value fits a field's annotation, as far as its outermost type goes."""
    if hint is Any:
        return True
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return any(_accepts(option, value) for option in typing.get_args(hint))
    cls = typing.get_origin(hint) or hint
    if cls in (int, float) and isinstance(value, bool):
        return False
    return isinstance(value, (int, float) if cls is float else cls)


def _words(hint: Any) -> str:
    options = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)
    plain = {
        int: "a whole number",
        str: "text",
        bool: "true or false",
        float: "a number",
        type(None): "nothing",
    }
    return " or ".join(plain.get(o) or f"a {getattr(typing.get_origin(o) or o, '__name__', o)}" for o in options)
