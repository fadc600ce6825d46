"""Annotations of fields: whether a value conforms to one, its description in a message, check of a dataclass."""

from __future__ import annotations

import dataclasses
import functools
import numbers
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .errors import ParameterError

_NAMES = {float: "a number", int: "an integer", str: "a text", types.NoneType: "None"}
_MAX_INTEGER = 2**63
"""Magnitude below which an integer must be: integers of 64 bits."""


def type_hints(cls: Any) -> dict[str, Any]:
    """The annotations of a class as types; empty if they contain names imported for type checking only."""
    try:
        return _resolved(cls)
    except NameError:
        return {}


@functools.cache
def _resolved(cls: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def conforms(value: Any, hint: Any, *, lists: bool = False) -> bool:
    """Whether a value conforms to an annotation of numbers, texts, classes, arrays, unions and collections of these.

    Any other annotation is conformed to by every value. With `lists`, a list conforms to the annotation of a tuple. The
    contents of an array are not seen.
    """
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return any(conforms(value, each, lists=lists) for each in arguments)
    if hint is float:
        return _is_number(value)
    if hint is int:
        return isinstance(value, numbers.Integral) and not isinstance(value, bool) and abs(int(value)) < _MAX_INTEGER
    if origin is np.ndarray:
        return hasattr(value, "__array__") or isinstance(value, tuple | list)
    if origin is Mapping:
        return isinstance(value, Mapping) and all(
            conforms(part, of_part, lists=lists)
            for item in value.items()
            for part, of_part in zip(item, arguments, strict=True)
        )
    if origin in (tuple, Sequence):
        kinds = (Sequence,) if origin is Sequence else (tuple, list) if lists else (tuple,)
        if not isinstance(value, kinds) or isinstance(value, str | bytes):
            return False
        of_items = arguments if origin is tuple and arguments[1:] != (...,) else arguments[:1] * len(value)
        return len(value) == len(of_items) and all(
            conforms(item, of_item, lists=lists) for item, of_item in zip(value, of_items, strict=True)
        )
    return not isinstance(hint, type) or isinstance(value, hint)


def _is_number(value: Any) -> bool:
    """Whether a value is a real number that a float can represent; NaN and infinity are."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def describe(hint: Any) -> str:
    """An annotation in words: `a number`, `a text or an instance of SplitRange`."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(describe(each) for each in arguments)
    if origin is np.ndarray:
        return "an array of numbers"
    if origin is Mapping:
        return f"a mapping, from {describe(arguments[0])} to {describe(arguments[1])}"
    if origin is Sequence or (origin is tuple and arguments[1:] == (...,)):
        return f"a {'tuple' if origin is tuple else 'sequence'}, each element of which is {describe(arguments[0])}"
    if origin is tuple:
        return f"a tuple of {len(arguments)} values ({', '.join(describe(each) for each in arguments)})"
    if origin is not None:
        return "anything"
    return _NAMES.get(hint) or f"an instance of {getattr(hint, '__name__', hint)}"


def abridged(value: Any) -> str:
    """The representation of a value, with at most 80 characters."""
    return _shortened(repr, value)


def one_line(value: Any) -> str:
    """The text of a value for a message, on one line with at most 80 characters."""
    return _shortened(lambda each: " ".join(str(each).split()), value)


def _shortened(write: Callable[[Any], str], value: Any) -> str:
    try:
        text = write(value)
    except Exception:  # an integer of more than 4300 digits, or a class that cannot be printed
        is_integer = isinstance(value, int)
        return "an integer of thousands of digits" if is_integer else f"an instance of {type(value).__name__}"
    return text if len(text) <= 80 else f"{text[:77]}..."


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
        if field.init and not conforms(value, hint, lists=True):
            raise ParameterError(
                f"{type(obj).__name__}: {field.name} must be {describe(hint)}; it is {abridged(value)}."
            )
