"""Fields of a model in a TOML table: reading of declared parameters, and matching of values with annotations."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...bench.readers import read_csv
from ...core.declaration import Parameter
from ...core.errors import ParameterError
from .location import Location, located_errors, read_number, with_article

_TYPE_NAMES = {int: "an integer", str: "a text", bool: "true or false", float: "a number", type(None): "nothing"}


def check_required(cls: type[Any], given: Mapping[str, Any], hints: Mapping[str, Any], location: Location) -> None:
    """Raise ParameterError if a required field of a model class is not given."""
    for field in dataclasses.fields(cls):
        optional = field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING
        if not field.init or optional or field.name in given:
            continue
        what = _describe_field(field, hints[field.name])
        raise ParameterError(f"{location}: {cls.__name__} needs '{field.name}' {what}; it is missing.")


def _describe_field(field: dataclasses.Field[Any], hint: Any) -> str:
    facts = field.metadata
    if "unit" in facts:
        return f"[{facts['unit']}] ({facts['symbol']}, {facts['meaning']})"
    return f"({facts['meaning'] if facts else describe_type(hint)})"


def read_parameter(value: Any, declared: Parameter, hint: Any, location: Location) -> Any:
    """Value of a declared parameter in SI units: a number, or a tuple of numbers if the annotation is a tuple.

    A tuple may also be a column of a data file. Raises ParameterError, UnitError, FileError or ColumnError.
    """
    where = f"{location}, {declared.name}"
    many = typing.get_origin(hint) is tuple
    if isinstance(value, Mapping) and many:
        return _read_column(value, where, location.folder)
    if isinstance(value, list) != many:
        expected = "a list of numbers" if many else "one number"
        raise ParameterError(
            f"{where} is {value!r}; it must be {expected} in {declared.unit} ({declared.symbol}, {declared.meaning})."
        )
    if many:
        return tuple(_read_declared(v, declared, f"{where}[{i}]") for i, v in enumerate(value))
    return _read_declared(value, declared, where)


def _read_declared(value: Any, declared: Parameter, where: str) -> float:
    return read_number(value, declared.unit, where, f" ({declared.symbol}, {declared.meaning})")


def _read_column(value: Mapping[str, Any], where: str, folder: Path) -> tuple[float, ...]:
    """Column of a data file as a tuple, in the SI unit of recordings."""
    if set(value) != {"file", "column"} or not all(isinstance(v, str) for v in value.values()):
        raise ParameterError(
            f'{where} is {value!r}; write a column of a file as {{ file = "data/map.csv", column = "force" }}.'
        )
    with located_errors(where):
        recording = read_csv(folder / value["file"])
        return tuple(float(v) for v in recording[value["column"]])


def accepts(hint: Any, value: Any) -> bool:
    """Whether a value matches the outermost type of an annotation."""
    if hint is Any:
        return True
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return any(accepts(option, value) for option in typing.get_args(hint))
    cls = typing.get_origin(hint) or hint
    if cls in (int, float) and isinstance(value, bool):
        return False
    return isinstance(value, (int, float) if cls is float else cls)


def item_type(hint: Any) -> Any:
    """Type of the items of a tuple annotation, which may be an option of a union; Any if there is no tuple."""
    tuples = (option for option in _options(hint) if typing.get_origin(option) is tuple)
    return next((typing.get_args(option)[0] for option in tuples), Any)


def describe_type(hint: Any) -> str:
    """Description of an annotation in words, for error messages: 'a number', 'a Valve or a text'."""
    return " or ".join(_TYPE_NAMES.get(o) or with_article(_class_name(o)) for o in _options(hint))


def _class_name(hint: Any) -> str:
    return str(getattr(typing.get_origin(hint) or hint, "__name__", hint))


def _options(hint: Any) -> tuple[Any, ...]:
    """Options of a union annotation; the annotation alone if it is no union."""
    return typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)
