"""Short representation of results: class, fields with values, and the shapes of arrays, on at most
ten lines.
"""

import dataclasses
import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np

from .annotation import is_model

MAX_LINES = 10
"""Maximum number of lines of a representation (chosen)."""
MAX_VALUE = 60
"""Maximum number of characters of a value."""
WIDTH = 100
"""Characters of a line."""
MAX_DESCRIPTION = 300
"""Characters above which a description names the parts of a model without their numbers
(chosen).
"""


class ShortRepr:
    """Base of results whose complete content would fill pages: their `repr` names each field on at
    most ten lines.
    """

    def __repr__(self) -> str:
        fields = [f.name for f in dataclasses.fields(self) if f.repr]  # type: ignore[arg-type]
        items = [f"{name}={_value(getattr(self, name))}" for name in fields]
        text = f"{type(self).__name__}({', '.join(items)})"
        lines = textwrap.wrap(
            text, WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
        )
        return "\n".join(
            lines if len(lines) <= MAX_LINES else [*lines[: MAX_LINES - 1], "    ...)"]
        )


def _value(value: Any) -> str:
    """A value in one line of at most `MAX_VALUE` characters."""
    if isinstance(value, np.ndarray):
        return f"array of shape {value.shape}"
    if isinstance(value, float | np.floating):
        return f"{float(value):.6g}"
    if isinstance(value, bool | int | str | None):
        return textwrap.shorten(repr(value), MAX_VALUE, placeholder=" ...'")
    if isinstance(value, Mapping):
        return f"{{{textwrap.shorten(', '.join(map(str, value)), MAX_VALUE, placeholder=' ...')}}}"
    if isinstance(value, tuple | list):
        return _sequence(value)
    if is_model(value):
        return (
            f"{type(value).__name__}(...)"
            if dataclasses.fields(value)
            else f"{type(value).__name__}()"
        )
    return textwrap.shorten(" ".join(repr(value).split()), MAX_VALUE, placeholder=" ...")


def _sequence(value: tuple[Any, ...] | list[Any]) -> str:
    """A short sequence of numbers or texts, otherwise the number of its items and their class."""
    if all(isinstance(item, float | int | str) for item in value):
        texts = ", ".join(map(_value, value))
        if len(texts) + 2 <= MAX_VALUE:
            return f"({texts})"
    classes = list(dict.fromkeys(type(item).__name__ for item in value))
    kinds = " and ".join(classes[:2])
    if len(classes) > 2:
        kinds += " ..."
    return f"({len(value)} of {kinds})"


def describe_model(model: Any) -> str:
    """A model in one line: its class and the fields that differ from their defaults, or only the
    classes of its parts if that line were too long; reports have all numbers. Floats have twelve
    digits, without the rounding of units.
    """
    text = _described(model)
    return text if len(text) <= MAX_DESCRIPTION else _structure(model)


def _described(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_described, value))}{',' * (len(value) == 1)})"
    if not is_model(value):
        return repr(value)
    texts = []
    for field in dataclasses.fields(value):
        item = getattr(value, field.name)
        default = field.default
        is_default = (
            type(item) is type(default)
            and not isinstance(item, np.ndarray)
            and bool(item == default)
        )
        if field.repr and not is_default:
            texts.append(f"{field.name}={_described(item)}")
    return f"{type(value).__name__}({', '.join(texts)})"


def _structure(model: Any) -> str:
    """The class of a model with those of its parts."""
    values = [getattr(model, field.name) for field in dataclasses.fields(model)]
    parts = [
        item
        for value in values
        for item in (value if isinstance(value, tuple) else (value,))
        if is_model(item)
    ]
    return type(model).__name__ + (f"({', '.join(map(_structure, parts))})" if parts else "")
