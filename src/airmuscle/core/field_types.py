"""Check of the fields of a dataclass that is not a model: each value must conform to the annotation of its field."""

from __future__ import annotations

import dataclasses
import numbers
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .annotation import abridged, conforms, describe, type_hints
from .errors import ParameterError

_MAX_INTEGER = 2**63
"""Magnitude below which an integer must be: integers of 64 bits."""


def check_field_types(obj: Any) -> None:
    """Raise ParameterError, with class and field, if a field of a dataclass does not conform to its annotation.

    Numbers, texts, classes, arrays, unions, tuples, sequences and mappings of these are checked; any other annotation
    is conformed to by every value. A list conforms to the annotation of a tuple; the contents of an array are not seen.
    """
    hints = type_hints(type(obj))
    for field in dataclasses.fields(obj):
        hint = hints.get(field.name)
        value: Any = getattr(obj, field.name, None)
        if type(value) is hint and (hint is not int or abs(value) < _MAX_INTEGER):  # most often so, and fast
            continue
        if field.init and not _conforms(value, hint):
            raise ParameterError(
                f"{type(obj).__name__}: {field.name} must be {_describe(hint)}; it is {abridged(value)}."
            )


def _conforms(value: Any, hint: Any) -> bool:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return any(_conforms(value, each) for each in arguments)
    if hint is float:
        return _is_number(value)
    if hint is int:
        return conforms(value, int) and abs(value) < _MAX_INTEGER
    if origin is np.ndarray:
        return hasattr(value, "__array__") or isinstance(value, tuple | list)
    if origin is Mapping:
        return isinstance(value, Mapping) and all(
            _conforms(each, which) for item in value.items() for each, which in zip(item, arguments, strict=True)
        )
    if origin in (tuple, Sequence):
        if not isinstance(value, tuple | list if origin is tuple else Sequence) or isinstance(value, str | bytes):
            return False
        if origin is tuple and arguments[1:] != (...,):
            return len(value) == len(arguments) and all(map(_conforms, value, arguments))
        return all(_conforms(each, arguments[0]) for each in value)
    return conforms(value, hint)


def _is_number(value: Any) -> bool:
    """Whether a value is a real number that a float can represent; NaN and infinity are."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def _describe(hint: Any) -> str:
    """An annotation in words: `a number`, `a mapping of a text to a number`."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_describe(each) for each in arguments)
    if hint is float:
        return "a number"
    if origin is np.ndarray:
        return "an array of numbers"
    if origin is Mapping:
        return f"a mapping, from {_describe(arguments[0])} to {_describe(arguments[1])}"
    if origin is Sequence or (origin is tuple and arguments[1:] == (...,)):
        return f"a {'tuple' if origin is tuple else 'sequence'}, each element of which is {_describe(arguments[0])}"
    if origin is tuple:
        return f"a tuple of {len(arguments)} values ({', '.join(_describe(each) for each in arguments)})"
    return "anything" if origin is not None else describe(hint)
