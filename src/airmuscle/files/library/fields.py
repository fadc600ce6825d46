"""Fields of an object in a TOML table: their declaration, the reading of numbers, and values against annotations."""

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping
from typing import Any

from ...bench.readers import read_csv
from ...core import Parameter, ParameterError, abridged
from .location import Location, located_errors, read_number, with_article

Reader = Callable[[Any, Any, Location], Any]
"""Reads the value of a field, given what the reader of the table knows, and the location of the value."""
_TYPE_NAMES = {int: "an integer", str: "a text in quotes", bool: "true or false", float: "a number"}
_ITEMS = {str: ' of texts, such as ["pressure", "force"]', float: " of numbers"}
_PLAIN = (int, float, str, bool, tuple, types.NoneType)


def under(key: str) -> dict[str, str]:
    """Metadata of a dataclass field that has another key in a file, or none if `key` is empty."""
    return {"key": key}


def custom_field(read: Reader, meaning: str, **field: Any) -> Any:
    """Declare a dataclass field that `read` reads from a file, instead of a parameter with a fixed unit."""
    return dataclasses.field(metadata={"read": read, "meaning": meaning}, **field)


def is_required(field: dataclasses.Field[Any]) -> bool:
    """Whether a dataclass cannot be made without a field."""
    return field.init and field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def check_required(
    cls: type[Any], given: Mapping[str, Any], hints: Mapping[str, Any], location: Location, is_named: bool
) -> None:
    """Raise ParameterError if a required field of a class is not given, or is a blank text.

    is_named  whether the table names the class
    """
    for field in dataclasses.fields(cls):
        value = given.get(field.name)
        if not is_required(field) or (field.name in given and not (isinstance(value, str) and not value.strip())):
            continue
        key = field.metadata.get("key", field.name)
        hint = hints[field.name]
        if is_named:
            raise ParameterError(
                f"{location}: {cls.__name__} needs '{key}' {_describe_field(field, hint)}; it is missing."
            )
        if "meaning" in field.metadata:
            raise ParameterError(f"{location}: '{key}' is missing: {field.metadata['meaning']}.")
        what = f"the table [{key}]" if describes_tables(hint) else f"'{key}'"
        raise ParameterError(f"{location}: {what} is missing; it must be {describe_type(hint)}.")


def _describe_field(field: dataclasses.Field[Any], hint: Any) -> str:
    facts = field.metadata
    if "unit" in facts:
        return f"[{facts['unit']}] ({facts['symbol']}, {facts['meaning']})"
    return f"({facts.get('meaning') or describe_type(hint)})"


def read_parameter(value: Any, declared: Parameter, hint: Any, location: Location) -> Any:
    """Value of a declared parameter in SI units: a number, or a tuple of numbers if the annotation is a tuple.

    A tuple may also be a column of a data file. Raises ParameterError, UnitError, FileError or ColumnError.
    """
    where = location.at(declared.name)
    many = origin(hint) is tuple
    if isinstance(value, Mapping) and many:
        return _read_column(value, where)
    if isinstance(value, list) != many:
        expected = "a list of numbers" if many else "one number"
        raise ParameterError(
            f"{where} is {abridged(value)}; it must be {expected} in {declared.unit} ({declared.symbol}, "
            f"{declared.meaning})."
        )
    if many:
        return tuple(_read_declared(v, declared, f"{where}[{i}]") for i, v in enumerate(value))
    return _read_declared(value, declared, where)


def _read_declared(value: Any, declared: Parameter, where: object) -> float:
    return read_number(value, declared.unit, where, f" ({declared.symbol}, {declared.meaning})")


def _read_column(value: Mapping[str, Any], where: Location) -> tuple[float, ...]:
    """Column of a data file as a tuple, in the SI unit of recordings."""
    if set(value) != {"file", "column"} or not all(isinstance(v, str) for v in value.values()):
        raise ParameterError(
            f'{where} is {abridged(value)}; write a column of a file as {{ file = "data/map.csv", column = "force" }}.'
        )
    with located_errors(where):
        recording = read_csv(where.folder / value["file"])
        return tuple(float(v) for v in recording[value["column"]])


def options(hint: Any) -> tuple[Any, ...]:
    """Options of a union annotation; the annotation alone if it is no union."""
    return typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)


def origin(hint: Any) -> Any:
    """The class of an annotation without its arguments: `tuple` of `tuple[float, ...]`."""
    return typing.get_origin(hint) or hint


def is_table(hint: Any) -> bool:
    """Whether an annotation allows an object that a table describes."""
    return hint is not None and any(origin(option) not in _PLAIN for option in options(hint))


def describes_tables(hint: Any) -> bool:
    """Whether an annotation allows only objects that tables describe, one or a list."""
    return is_table(hint) and all(origin(o) not in _PLAIN or o in (tuple, types.NoneType) or origin(o) is tuple
                                  for o in options(hint))  # fmt: skip


def accepts(hint: Any, value: Any) -> bool:
    """Whether a value matches the outermost type of an annotation."""
    if hint is Any:
        return True
    if len(options(hint)) > 1:
        return any(accepts(option, value) for option in options(hint))
    cls = origin(hint)
    if cls in (int, float) and isinstance(value, bool):
        return False
    return isinstance(value, (int, float) if cls is float else cls)


def item_type(hint: Any) -> Any:
    """Type of the items of a tuple annotation, which may be an option of a union; None if there is no tuple."""
    tuples = (option for option in options(hint) if origin(option) is tuple)
    return next((typing.get_args(option)[0] for option in tuples), None)


def describe_type(hint: Any) -> str:
    """Description of an annotation in words, for error messages: 'a number', 'a Valve or a list of texts'."""
    words = []
    for option in options(hint):
        if origin(option) is tuple:
            words.append(f"a list{_ITEMS.get(item_type(option), '')}")
        elif option is not types.NoneType:
            name = origin(option)
            words.append(_TYPE_NAMES.get(name) or with_article(str(getattr(name, "__name__", name))))
    return " or ".join(words)
