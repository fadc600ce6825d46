"""Annotation of a structural field: whether a value conforms to it, and its description in a message."""

from __future__ import annotations

import functools
import numbers
import types
import typing
from collections.abc import Callable
from typing import Any

_NAMES = {int: "an integer", str: "a text", types.NoneType: "None"}


def type_hints(cls: Any) -> dict[str, Any]:
    """The annotations of a class as types; empty if they contain names imported for type checking only."""
    try:
        return _resolved(cls)
    except NameError:
        return {}


@functools.cache
def _resolved(cls: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def conforms(value: Any, hint: Any) -> bool:
    """Whether a value conforms to an annotation of classes, integers, texts, None, unions and tuples of these.

    Any other annotation is conformed to by every value.
    """
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return any(conforms(value, each) for each in arguments)
    if origin is tuple:
        return isinstance(value, tuple) and (arguments[1:] != (...,) or all(conforms(v, arguments[0]) for v in value))
    if hint is int:
        return isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if hint is float or not isinstance(hint, type):
        return True
    return isinstance(value, hint)


def describe(hint: Any) -> str:
    """An annotation in words: `an instance of Orifice`, `a text or an instance of SplitRange`."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(describe(each) for each in arguments)
    if origin is tuple:
        return f"a tuple, each element of which is {describe(arguments[0])}"
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
