"""Annotations of fields and arguments: whether a value conforms, its description, checks of a
dataclass and a call.
"""

import dataclasses
import functools
import inspect
import numbers
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .annotation_parts import AnyArray, alternatives, arguments_of, origin, type_hints
from .errors import AirmuscleError, FileError, ParameterError

_NAMES = {
    AnyArray: "an array of numbers",
    float: "a number",
    int: "an integer",
    str: "a text",
    types.NoneType: "None",
}
_MAX_INTEGER = 2**63
"""Magnitude below which an integer must be: integers of 64 bits."""


def conforms(value: Any, hint: Any, *, lists: bool = False) -> bool:
    """Whether a value conforms to an annotation of numbers, texts, classes, arrays, unions and
    collections of these.

    Any other annotation is conformed to by every value. With `lists`, a list conforms to the
    annotation of a tuple. The contents of an array are seen where the annotation is `ArrayLike`
    only.
    """
    options = alternatives(hint)
    return any(_conforms(value, option, lists=lists) for option in options)


def _conforms(value: Any, hint: Any, *, lists: bool) -> bool:
    """Whether a value conforms to an annotation that is no union."""
    if hint is AnyArray:
        return is_numeric(value)
    if hint is float:
        return _is_number(value)
    if hint is int:
        return (
            isinstance(value, numbers.Integral)
            and not isinstance(value, bool)
            and abs(int(value)) < _MAX_INTEGER
        )
    arguments = arguments_of(hint)
    if arguments:
        return _conforms_to_parts(value, origin(hint), arguments, lists=lists)
    return (
        hint is Any
        or not isinstance(hint, type)
        or getattr(hint, "_is_protocol", False)
        or isinstance(value, hint)
    )


def _conforms_to_parts(value: Any, kind: Any, arguments: tuple[Any, ...], *, lists: bool) -> bool:
    """Whether a value conforms to a class with arguments, such as a tuple of numbers."""
    if kind is np.ndarray:
        return hasattr(value, "__array__") or isinstance(value, tuple | list)
    if kind is Mapping:
        return isinstance(value, Mapping) and all(
            _conform(item, arguments, lists=lists) for item in value.items()
        )
    if kind is tuple:
        kinds = (tuple, list) if lists else (tuple,)
        return isinstance(value, kinds) and _conform(value, arguments, lists=lists)
    if kind is Callable:
        return callable(value) and _takes(value, arguments[0])
    if kind in (Sequence, Collection, Iterable):
        return _conforms_to_collection(value, kind, arguments[0], lists=lists)
    return True


def _conforms_to_collection(value: Any, kind: Any, of_item: Any, *, lists: bool) -> bool:
    """Whether a value conforms to a sequence, a collection or an iterable of items."""
    if kind is Sequence:
        is_sequence = isinstance(value, Sequence) and not isinstance(value, str | bytes)
        return is_sequence and _conform(value, (of_item, ...), lists=lists)
    if isinstance(value, Collection) and np.ndim(value) > 0:  # type: ignore[arg-type]
        return all(conforms(item, of_item, lists=lists) for item in value)
    return isinstance(value, kind) and not isinstance(value, np.ndarray)


def _conform(items: Sequence[Any], arguments: tuple[Any, ...], *, lists: bool) -> bool:
    """Whether items conform to as many annotations, or all to the one before an ellipsis."""
    if arguments[1:] == (...,):
        arguments = arguments[:1] * len(items)
    if len(items) != len(arguments):
        return False
    pairs = zip(items, arguments, strict=True)
    return all(conforms(item, of_item, lists=lists) for item, of_item in pairs)


def is_model(obj: Any) -> bool:
    """Whether an object is a dataclass, as all models are."""
    return dataclasses.is_dataclass(obj) and not isinstance(obj, type)


def is_numeric(value: Any) -> bool:
    """Whether a value is a number or an array of numbers, or becomes one."""
    try:
        return np.asarray(value).dtype.kind in "biuf"
    except (ValueError, TypeError, OverflowError):  # rows of unequal length, or no array at all
        return False


def _takes(function: Callable[..., Any], arguments: Any) -> bool:
    """Whether a function can be called with the declared arguments; a class that does not tell, as
    `int`, cannot.
    """
    if not isinstance(arguments, list):
        return True
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError:
        return False
    except ValueError:  # a function that is not written in Python
        return not isinstance(function, type)
    return True


def _is_number(value: Any) -> bool:
    """Whether a value is a real number that a float can represent; NaN and infinity are."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def describe(hint: Any, levels: int = 4) -> str:
    """An annotation in words: `a number`, `a text or an instance of SplitRange`; parts inside parts
    down to this level, because an alias may contain itself.
    """
    return " or ".join(_described(option, levels) for option in alternatives(hint))


def _described(hint: Any, levels: int) -> str:
    if levels == 0:
        return "anything"
    kind = origin(hint)
    arguments = arguments_of(hint)
    if not arguments:
        return _NAMES.get(hint) or f"an instance of {getattr(hint, '__name__', hint)}"
    described = functools.partial(describe, levels=levels - 1)
    if kind is Callable:
        parameters = arguments[0] if isinstance(arguments[0], list) else []
        words = " and ".join(map(described, parameters))
        return f"a function of {words}" if words else "a function"
    if kind in (Collection, Iterable):
        return f"several values, each of which is {described(arguments[0])}"
    if kind is np.ndarray:
        return "an array of numbers"
    if kind is Mapping:
        return f"a mapping, from {described(arguments[0])} to {described(arguments[1])}"
    if kind is Sequence:
        return f"a sequence, each element of which is {described(arguments[0])}"
    if kind is tuple and arguments[1:] == (...,):
        return f"a tuple, each element of which is {described(arguments[0])}"
    if kind is tuple:
        words = ", ".join(map(described, arguments))
        return f"a tuple of {len(arguments)} values ({words})"
    return "anything"


def abridged(value: Any) -> str:
    """The representation of a value, with at most 80 characters."""
    return _shortened(repr, value)


def counted(number: int, noun: str) -> str:
    """A number of things as a text."""
    return f"{number} {noun}{'' if number == 1 else 'es' if noun.endswith('ch') else 's'}"


def one_line(value: Any) -> str:
    """The text of a value for a message, on one line with at most 80 characters."""
    return _shortened(lambda content: " ".join(str(content).split()), value)


def _shortened(write: Callable[[Any], str], value: Any) -> str:
    try:
        text = write(value)
    except Exception:  # an integer of more than 4300 digits, or a class that cannot be printed
        is_integer = isinstance(value, int)
        return (
            "an integer of thousands of digits"
            if is_integer
            else f"an instance of {type(value).__name__}"
        )
    return text if len(text) <= 80 else f"{text[:77]}..."


def within(low: float, high: float, **field: Any) -> Any:
    """Declare a number without a unit, such as a number of samples, as a dataclass field with
    closed bounds.
    """
    return dataclasses.field(metadata={"within": (low, high)}, **field)


def check_within(obj: Any, field: "dataclasses.Field[Any]") -> None:
    """Raise ParameterError if the number of a field is not within the bounds that it declares."""
    if "within" not in field.metadata:
        return
    low, high = field.metadata["within"]
    value = getattr(obj, field.name)
    if not low <= value <= high:
        raise ParameterError(
            f"{type(obj).__name__}: {field.name} is {value}; allowed range: {low} to {high}."
        )


def check_field_types(obj: Any) -> None:
    """Raise ParameterError, with class and field, if a field of a dataclass does not conform to its
    annotation.

    Numbers, texts, classes, arrays, unions, tuples, sequences and mappings of these are checked;
    any other annotation is conformed to by every value. A list conforms to the annotation of a
    tuple; the contents of an array are not seen.
    """
    hints = type_hints(type(obj))
    for field in dataclasses.fields(obj):
        value: Any = getattr(obj, field.name, None)
        if value is None and field.default is None:
            continue
        hint = hints.get(field.name)
        if type(value) is hint and (
            hint is not int or abs(value) < _MAX_INTEGER
        ):  # most often so, and fast
            pass
        elif field.init and not conforms(value, hint, lists=True):
            raise ParameterError(
                f"{type(obj).__name__}: {field.name} must be {describe(hint)}; it is"
                f" {abridged(value)}."
            )
        check_within(obj, field)


def check_whole(owner: str, name: str, value: Any, least: int) -> None:
    """Raise ParameterError if an argument is no integer of at least `least`."""
    if not conforms(value, int) or value < least:
        raise ParameterError(
            f"{owner}: {name} is {abridged(value)}; it must be a whole number of at least {least}."
        )


def check_arguments(
    function: Callable[..., Any],
    positional: Sequence[Any],
    named: Mapping[str, Any],
    failure: Exception,
) -> None:
    """Name the argument that is wrong where a call failed: it does not conform to its annotation,
    is empty, or no path.

    Raises ParameterError or FileError, with function and argument; nothing where the failure has a
    message of its own, where no argument is the cause, or where one is left out, which Python says.
    """
    if isinstance(failure, AirmuscleError):
        return
    try:
        bound = inspect.signature(function).bind(*positional, **named)
    except TypeError:
        return
    hints = type_hints(function)
    owner = function.__name__
    for name, value in bound.arguments.items():
        declared = bound.signature.parameters[name]
        hint = hints.get(name)
        for item in value if declared.kind is declared.VAR_POSITIONAL else (value,):
            if not _suits(item, hint):
                raise ParameterError(
                    f"{owner}: {name} must be {describe(hint)}; it is {abridged(item)}."
                ) from failure
        is_several = isinstance(value, Sequence | Mapping) and not isinstance(value, str)
        if is_several and not value and value is not declared.default:
            raise ParameterError(f"{owner}: {name} is empty; give at least one.") from failure
        is_path = Path in alternatives(hint) and isinstance(value, str | Path)
        if is_path and (isinstance(failure, OSError) or not Path(value).name or "\0" in str(value)):
            reason = failure.strerror if isinstance(failure, OSError) else failure
            raise FileError(
                f"{owner}: {name} is {abridged(value)}, which is no usable path: {reason}."
            ) from failure


def _suits(value: Any, hint: Any) -> bool:
    """Whether a value conforms to the annotation of an argument, as which an array serves for a
    sequence.
    """
    options = alternatives(hint)
    if len(options) > 1 and AnyArray not in options:
        return any(_suits(value, option) for option in options)
    if origin(hint) is np.ndarray:
        return is_numeric(value) and np.ndim(value) > 0
    return conforms(value, hint, lists=True) or (
        isinstance(value, np.ndarray)
        and value.ndim > 0
        and conforms(value.tolist(), hint, lists=True)
    )
