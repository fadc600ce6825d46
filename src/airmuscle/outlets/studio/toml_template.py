"""TOML text with places for parameters: texts between the places, so that a page fills in numbers without a server.

A template is a list of texts and integers: an integer is the place of the parameter of this index, which is written
as Python writes a float.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from ...core import tree
from ...core.errors import ParameterError

_FIRST = 7.0e250
"""The first of the marks: numbers that no file contains."""
_STEP = 1.0e240
_MARK = re.compile(r"7(?:\.\d+)?e\+250")

Template = list[str | int]


def toml_template(write: Callable[[Any], str], model: Any, count: int) -> Template:
    """The template of the text that `write` makes of a model with `count` leaves. Raises ParameterError."""
    marks = [_FIRST + i * _STEP for i in range(count)]
    place = {repr(mark): i for i, mark in enumerate(marks)}
    text = write(tree.unflatten(model, marks))
    template: Template = []
    end = 0
    for match in _MARK.finditer(text):
        template += [text[end : match.start()], place[match.group()]]
        end = match.end()
    template.append(text[end:])
    missing = set(range(count)) - {item for item in template if isinstance(item, int)}
    if missing:
        raise ParameterError(f"{type(model).__name__}: {len(missing)} parameters do not appear in its file.")
    return template


def fill_template(template: Template, values: list[float]) -> str:
    """The text with these values, as the page fills it in."""
    return "".join(repr(values[item]) if isinstance(item, int) else item for item in template)
