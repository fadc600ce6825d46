"""Quantity arguments of public methods: texts with a unit and lists become numbers, anything else
is an error.
"""

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core import NUMBERS, ParameterError, one_line, quantity

_ARRAY, _DOUBLE = np.ndarray, np.dtype(np.float64)
_EXAMPLES = {"Pa": "'3 bar'", "N": "'200 N'", "1": "'10 %'"}
"""A text for each unit of an argument."""
Units = Mapping[str, Sequence[str]]
"""Units of the leading arguments of methods, by the name of the method."""
RatioCheck = Callable[[Any, object], None]
"""Check of a ratio, of the value and the object: called for every value that is not a float of at
most 1.
"""


def accept_quantities(
    method: Callable[..., Any], units: Sequence[str], check_ratio: RatioCheck | None = None
) -> Callable[..., Any]:
    """The method, whose leading arguments after `self` may also be texts with a unit, lists and
    arrays of integers.

    `check_ratio` is called with the argument whose unit is "1". Symbols and arrays of other
    libraries are passed on. A call with two numbers takes 0.2 us longer.
    """
    arguments = inspect.signature(method).parameters.values()
    names = [a.name for a in arguments if a.kind in (a.POSITIONAL_ONLY, a.POSITIONAL_OR_KEYWORD)][
        1 : 1 + len(units)
    ]
    unit_of = dict(zip(names, units, strict=False))  # a user's method may have fewer
    place = units.index("1") if check_ratio is not None and "1" in units[: len(names)] else -1

    def owner_of(thing: Any) -> str:
        return f"{type(thing).__name__}.{method.__name__}"

    @functools.wraps(method)
    def converted(self: Any, *given: Any, **named: Any) -> Any:
        try:
            if len(given) == 2 and not named:  # the usual call: as short as it can be
                a, b = given
                if (type(a) in NUMBERS or (type(a) is _ARRAY and a.dtype is _DOUBLE)) and (
                    type(b) in NUMBERS or (type(b) is _ARRAY and b.dtype is _DOUBLE)
                ):
                    if place >= 0 and not (type(given[place]) is float and given[place] <= 1.0):
                        check_ratio(given[place], self)  # type: ignore[misc]
                    return method(self, a, b)
            owner = owner_of(self)
            values = [
                _as_number(value, name, unit_of, owner)
                for value, name in zip(given, names, strict=False)
            ]
            named = {name: _as_number(value, name, unit_of, owner) for name, value in named.items()}
            if place >= 0:
                check_ratio(
                    values[place] if place < len(values) else named.get(names[place], 0.0), self
                )  # type: ignore[misc]
            return method(self, *values, *given[len(values) :], **named)
        except (TypeError, OverflowError):
            for name, value in (*zip(names, given, strict=False), *named.items()):
                if name in unit_of and (
                    isinstance(value, int | type) or not hasattr(value, "__add__")
                ):
                    _as_array(value, name, unit_of[name], owner_of(self))
            raise

    return converted


class QuantityMethods:
    """Base of classes that let the methods which they define accept quantities, as
    `accept_quantities` does.
    """

    argument_units: ClassVar[Units]
    check_ratio: ClassVar[Any] = None
    """A RatioCheck as a static method, or None."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for name, units in cls.argument_units.items():
            method = cls.__dict__.get(name)
            if inspect.isfunction(method) and not getattr(method, "__isabstractmethod__", False):
                setattr(cls, name, accept_quantities(method, units, cls.check_ratio))


def _as_number(value: Any, name: str, units: Mapping[str, str], owner: str) -> Any:
    """The argument as a number or an array of numbers in SI. Raises ParameterError or UnitError."""
    kind = type(value)
    if name not in units or kind in NUMBERS or (kind is np.ndarray and value.dtype.kind == "f"):
        return value
    if kind is str:
        return quantity(value, units[name], where=f"{owner}: {name}")
    if (
        value is None
        or kind in (bool, list, tuple, dict, set, bytes, complex)
        or kind is np.ndarray
    ):
        return _as_array(value, name, units[name], owner)
    return value


def _as_array(value: Any, name: str, unit: str, owner: str) -> Any:
    if not (value is None or isinstance(value, bool | dict | set | bytes | complex)):
        try:
            array = np.asarray(value)
        except ValueError:  # rows of unequal length
            array = np.array(None)
        if array.dtype.kind in "iuf":
            return array.astype(float)
    raise ParameterError(
        f"{owner}: {name} is {one_line(value)}; give a number or an array of numbers in"
        f" {unit if unit != '1' else 'SI'}, or a text with a unit, such as"
        f" {_EXAMPLES.get(unit, f'1 {unit}')}."
    )
