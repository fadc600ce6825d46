"""How a parameter is declared, once, and how a frozen model is taken apart and put together again.

A declared field is a leaf (a float or a tuple of floats) with unit, symbol, meaning and bounds.
Any other field is structure: another model, a tuple of models, a whole number, a name.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import typing
from typing import Any, TypeVar, dataclass_transform

import numpy as np

from .errors import ParameterError, suggestion

T = TypeVar("T")
INFINITY = math.inf


@dataclasses.dataclass(frozen=True)
class Parameter:
    """What is declared about one parameter of a model."""

    name: str
    unit: str
    symbol: str
    meaning: str
    bounds: tuple[float, float]
    fitted: bool
    default: Any


def parameter(
    unit: str,
    symbol: str,
    meaning: str,
    *,
    bounds: tuple[float, float] = (-INFINITY, INFINITY),
    fitted: bool = True,
    **field: Any,
) -> Any:
    """Declare a parameter on the field; docs, fits, TOML, command line and page read it here.

    `bounds` are closed and physical; `fitted=False` marks what a fit must leave alone (a length measured
    with a ruler, a clamp). Values are SI, in `unit`.
    """
    return dataclasses.field(
        metadata={"unit": unit, "symbol": symbol, "meaning": meaning, "bounds": bounds, "fitted": fitted},
        **field,
    )


@dataclass_transform(frozen_default=True, field_specifiers=(parameter, dataclasses.field))
def model(cls: type[T]) -> type[T]:
    """A frozen dataclass whose declared parameters are checked when it is made.

    It may be named in library and scenario files unless it says `from_file: ClassVar[bool] = False`. A model may define
    `check(self)` for what several parameters must satisfy together; it raises ParameterError.
    """
    if "from_file" not in cls.__dict__:
        cls.from_file = True  # type: ignore[attr-defined]
    if "__post_init__" not in cls.__dict__:
        cls.__post_init__ = _validate  # type: ignore[attr-defined]
    return dataclasses.dataclass(frozen=True)(cls)


def parameters(thing: Any) -> tuple[Parameter, ...]:
    """The declared parameters of a model or model class, in order, without those of nested models."""
    return tuple(
        Parameter(name=f.name, default=f.default, **f.metadata)
        for f in dataclasses.fields(thing)
        if "unit" in f.metadata
    )


def _validate(thing: Any) -> None:
    lists = {f.name for f in dataclasses.fields(thing) if "tuple" in str(f.type)}
    for declared in parameters(thing):
        value = getattr(thing, declared.name)
        if isinstance(value, tuple | list | np.ndarray) != (declared.name in lists):
            due = "several numbers, (1.0, 2.0)" if declared.name in lists else "one number"
            raise ParameterError(
                f"{type(thing).__name__}.{declared.name} ({declared.symbol}, {declared.meaning}) is {value!r}; "
                f"it must be {due}."
            )
        object.__setattr__(thing, declared.name, _checked(type(thing).__name__, declared, value))
    if hasattr(thing, "check"):
        thing.check()


def _checked(owner: str, declared: Parameter, value: Any) -> Any:
    if isinstance(value, tuple | list | np.ndarray):
        return tuple(_checked(owner, declared, v) for v in value)
    low, high = declared.bounds
    unit = "" if declared.unit == "1" else f" {declared.unit}"
    where = f"{owner}.{declared.name} ({declared.symbol}, {declared.meaning})"
    if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
        raise ParameterError(f"{where} is {value!r}; it must be a number{unit and ' in' + unit}.")
    if not math.isfinite(value):
        raise ParameterError(f"{where} is {value}; it must be finite.")
    if not low <= value <= high:
        raise ParameterError(
            f"{where} is {value:g}{unit}; allowed are {low:g} to {high:g}{unit}."
            f"{' Values are SI: check the unit.' if unit else _per_cent(float(value), high)}"
        )
    return float(value)


def _per_cent(value: float, high: float) -> str:
    """A question, where a ratio above its bound makes sense as per cent."""
    return f" Is it in per cent? As a ratio it is {value / 100:g}." if 0 < value / 100 <= high <= 1 < value else ""


def as_float(what: str, value: Any) -> float:
    """The number that is given. Raises ParameterError for anything else, as text with a unit is."""
    try:
        return float(0.0 + value)
    except (TypeError, ValueError):
        raise ParameterError(f"{what} is {value!r}; it must be one number, in SI units.") from None


def as_finite_float(what: str, value: Any) -> float:
    """The finite number that is given. Raises ParameterError for anything else."""
    number = as_float(what, value)
    if not math.isfinite(number):
        raise ParameterError(f"{what} is {value!r}; it must be finite.")
    return number


@functools.cache
def _kinds(cls: type[Any]) -> dict[str, type[Any]]:
    """What the structural fields of a model class hold, where that is one class of models."""
    try:
        hints = typing.get_type_hints(cls)
    except NameError:  # a class of one's own, whose annotations name what only a type checker imports
        return {}
    plain = {f.name: hints[f.name] for f in dataclasses.fields(cls) if "unit" not in f.metadata}
    return {n: k for n, k in plain.items() if isinstance(k, type) and k.__module__ not in ("builtins", "types")}


def attribute_hint(thing: Any, kind: type[Any]) -> str:
    """Sentence that names the fields of `thing` that hold an object of class `kind`; empty if there are none."""
    if not dataclasses.is_dataclass(thing) or isinstance(thing, type):
        return ""
    names = [f".{f.name}" for f in dataclasses.fields(thing) if isinstance(getattr(thing, f.name), kind)]
    return f" It contains one: write {' or '.join(names)} after it." if names else ""


def check_structure(thing: Any) -> None:
    """Raise ParameterError where a part, anywhere inside a model, is not of the kind that its field holds."""
    if isinstance(thing, tuple):
        for item in thing:
            check_structure(item)
    elif dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        for name, kind in _kinds(type(thing)).items():
            part = getattr(thing, name)
            if not isinstance(part, kind):
                raise ParameterError(
                    f"{type(thing).__name__}: its {name} must be of {kind.__name__}; it is {str(part)[:80]}."
                    f"{attribute_hint(part, kind)}"
                )
        for field in dataclasses.fields(thing):
            check_structure(getattr(thing, field.name))


def check_field(cls: type[Any], name: str) -> None:
    """Raise ParameterError, with the nearest name, where a model class has no field of this name."""
    known = [f.name for f in dataclasses.fields(cls) if f.init]
    if name not in known:
        raise ParameterError(
            f"{cls.__name__} has no parameter '{name}'; there are {', '.join(known)}.{suggestion(name, known)}"
        )
