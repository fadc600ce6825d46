"""Declaration and validation of models and their parameters.

A declared field is a leaf (a float or a tuple of floats) with unit, symbol, meaning and bounds.
Any other field is structure: another model, a tuple of models, an integer or a name.
"""

import dataclasses
import functools
import math
import operator
import warnings
from collections.abc import Iterator
from typing import Any, TypeVar, dataclass_transform

import numpy as np

from .absolute_pressure import AbsolutePressure
from .annotation import (
    abridged,
    check_within,
    conforms,
    describe,
    is_model,
    one_line,
    within,
)
from .annotation_parts import depth, type_hints
from .errors import AirmuscleWarning, ParameterError, check_known
from .short_repr import ShortRepr
from .units import is_known_unit, quantity, usual_unit

T = TypeVar("T")
INFINITY = math.inf
_MAX_INTEGER = 1_000_000
"""Maximum magnitude of an integer in a model, such as a number of segments (chosen)."""
_MAX_CHARACTERS = 200
"""Maximum length of a text in a model, such as a name (chosen)."""


_EXPECTED = (
    "one number",
    "several numbers, such as (1.0, 2.0)",
    "rows of numbers, such as ((1.0, 2.0), (3.0, 4.0))",
)
"""What a field of numbers must be, by the depth of its annotation."""


@dataclasses.dataclass(frozen=True)
class Parameter:
    """Declaration of one parameter of a model."""

    name: str
    unit: str
    symbol: str
    meaning: str
    bounds: tuple[float, float]
    fitted: bool
    default: Any
    plausible: float = 0.0


def parameter(
    unit: str,
    symbol: str,
    meaning: str,
    *,
    bounds: tuple[float, float] = (-INFINITY, INFINITY),
    fitted: bool = True,
    plausible: float = 0.0,
    **field: Any,
) -> Any:
    """Declare a parameter as a dataclass field; documentation, fits, TOML files and the command
    line read it from here.

    `bounds` are closed and physical; of `min_x` and `max_x` of one model the first must be less.
    `fitted=False` excludes the parameter from fits by default (a length measured with a ruler, a
    clamp). A value other than zero whose magnitude is below `plausible` causes an AirmuscleWarning.
    Values are in SI units, in `unit`, or texts with a unit, such as "300 mm".
    """
    declared = {
        "unit": unit,
        "symbol": symbol,
        "meaning": meaning,
        "bounds": bounds,
        "fitted": fitted,
    }
    return dataclasses.field(metadata={**declared, "plausible": plausible}, **field)


@dataclass_transform(frozen_default=True, field_specifiers=(parameter, within, dataclasses.field))
def model(cls: type[T]) -> type[T]:
    """Make a class a frozen dataclass whose declared parameters are validated on construction.

    Library and scenario files may name the class unless it declares `from_file: ClassVar[bool] =
    False`. A model may define `check(self)` for conditions on several parameters together; it
    raises ParameterError. The values of the other fields must conform to their annotations, unless
    the class declares `checks_structure: ClassVar[bool] = True` because its `check` does this. In
    Python a field also takes the more general type that the class variable `accepted` has by the
    name of the field.
    """
    if "from_file" not in cls.__dict__:
        cls.from_file = True  # type: ignore[attr-defined]
    if "__post_init__" not in cls.__dict__:
        cls.__post_init__ = _validate  # type: ignore[attr-defined]
    return dataclasses.dataclass(frozen=True, repr=not issubclass(cls, ShortRepr))(cls)


def forwarded(path: str) -> Any:
    """A property that is that of a part: `forwarded("inner.states")`."""
    return property(operator.attrgetter(path), doc=f"That of `{path.rpartition('.')[0] or path}`.")


def parameters(obj: Any) -> tuple[Parameter, ...]:
    """Return the declared parameters of a model or model class, in order, without those of nested
    models.
    """
    return _parameters_of(obj if isinstance(obj, type) else type(obj))


@functools.cache
def _parameters_of(cls: type[Any]) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(name=f.name, default=f.default, **f.metadata)
        for f in dataclasses.fields(cls)
        if "unit" in f.metadata
    )


@functools.cache
def _depths_of(cls: type[Any]) -> dict[str, int]:
    """The depth of the annotation of each field: 0 for one number, 1 for a list of numbers, 2 for a
    list of lists.
    """
    hints = type_hints(cls)
    if not hints:  # a name is imported for the type checker alone
        return {f.name: str(f.type).count("tuple[") for f in dataclasses.fields(cls)}
    return {name: depth(hint) for name, hint in hints.items()}


@functools.cache
def _limits_of(cls: Any) -> list[tuple[str, str]]:
    """The pairs of declared parameters `min_...` and `max_...`, of which the first must be less
    than the second.
    """
    names = [declared.name for declared in _parameters_of(cls)]
    pairs = [(name, f"max_{name[4:]}") for name in names if name.startswith("min_")]
    return [pair for pair in pairs if pair[1] in names]


def _validate(obj: Any) -> None:
    """Check every field, the order of limits, then the conditions of `check`. Raises ParameterError
    or UnitError.
    """
    if not getattr(obj, "checks_structure", False):
        _check_annotations(obj)
    kind: Any = type(obj)
    depths = _depths_of(kind)
    for declared in parameters(obj):
        value = getattr(obj, declared.name)
        if not _has_depth(value, depths[declared.name]):
            expected = _EXPECTED[depths[declared.name]]
            raise ParameterError(
                f"{type(obj).__name__}.{declared.name} ({declared.symbol}, {declared.meaning}) is "
                f"{abridged(value)}; it must be {expected}."
            )
        object.__setattr__(obj, declared.name, _check_value(type(obj).__name__, declared, value))
    check_together(obj)


def check_together(obj: Any) -> None:
    """Check what parameters of a model must fulfil together: the order of limits, the conditions of
    its `check`.
    """
    kind: Any = type(obj)
    for low, high in _limits_of(kind):
        least = getattr(obj, low)
        most = getattr(obj, high)
        if not least < most:
            raise ParameterError(
                f"{kind.__name__}: {low} {least:g} must be less than {high} {most:g}."
            )
    if hasattr(obj, "check"):
        obj.check()


def _has_depth(value: Any, depth: int) -> bool:
    """Whether a value is a number (depth 0), a list of numbers (1) or a list of such lists (2)."""
    if type(value) is float or not _is_list(value):
        return depth == 0
    return depth > 0 and all(_has_depth(item, depth - 1) for item in value)


def _is_list(value: Any) -> bool:
    return isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _check_value(owner: str, declared: Parameter, value: Any) -> Any:
    """The value as float, AbsolutePressure or tuple of these, a text with a unit in SI units.
    Raises ParameterError if it is not finite or out of bounds, UnitError if the unit has another
    dimension."""
    low, high = declared.bounds
    if type(value) is float and low <= value <= high and _is_plausible(declared, value):
        return value
    if _is_list(value):
        return tuple(_check_value(owner, declared, v) for v in value)
    unit = "" if declared.unit == "1" else f" {declared.unit}"
    label = f"{owner}.{declared.name} ({declared.symbol}, {declared.meaning})"
    allowed = f"allowed range: {low:g} to {high:g}{unit}."
    try:
        value = _as_number(declared.unit, label, value)
    except OverflowError:
        raise ParameterError(f"{label} is too large a number; {allowed}") from None
    if not math.isfinite(value):
        raise ParameterError(f"{label} is {value}; it must be finite.")
    if not low <= value <= high:
        hint = _hint_on_unit(declared, value)
        raise ParameterError(f"{label} is {value:g}{unit}; {allowed}{hint}")
    if not _is_plausible(declared, value):
        warnings.warn(
            f"{label} is {value:g}{unit}, which is implausibly small: values without a unit are in"
            f" SI units. Check the unit, or write it, such as '{value:g}"
            f" {usual_unit(value, declared.unit)}'.",
            AirmuscleWarning,
            stacklevel=5,
        )
    return value


def _as_number(unit: str, label: str, value: Any) -> Any:
    """A number as float or AbsolutePressure, a text with a unit in SI units. Raises ParameterError
    for anything else, OverflowError for a number that is too large.
    """
    if isinstance(value, str) and is_known_unit(unit):
        value = quantity(value, unit, where=label)
    if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
        in_unit = "" if unit == "1" else f" in {unit}"
        raise ParameterError(f"{label} is {abridged(value)}; it must be a number{in_unit}.")
    return value if isinstance(value, AbsolutePressure) else float(value)


def _is_plausible(declared: Parameter, value: float) -> bool:
    """Whether a value is zero, or finite and not as small as one in a wrong unit."""
    return value == 0.0 or declared.plausible <= abs(value) < math.inf


def _hint_on_unit(declared: Parameter, value: float) -> str:
    """The probable cause of a value out of bounds."""
    if declared.unit != "1":
        return " Values are in SI units; check the unit."
    _, high = declared.bounds
    is_per_cent = 0 < value / 100 <= high <= 1 < value
    return f" Is it in per cent? As a ratio it is {value / 100:g}." if is_per_cent else ""


def as_float(label: str, value: Any) -> float:
    """Return the value as a float. Raises ParameterError for anything but a number, such as a text
    with a unit.
    """
    try:
        return float(0.0 + value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{label} is {abridged(value)}; it must be one number, in SI units."
        ) from None


def as_finite_float(label: str, value: Any) -> float:
    """Return the value as a finite float. Raises ParameterError for anything else."""
    number = as_float(label, value)
    if not math.isfinite(number):
        raise ParameterError(f"{label} is {value!r}; it must be finite.")
    return number


def attribute_hint(obj: Any, kind: type[Any]) -> str:
    """Sentence that names the fields of `obj` that hold an object of class `kind`; empty if there
    are none.
    """
    if not is_model(obj):
        return ""
    names = [
        f".{f.name}" for f in dataclasses.fields(obj) if isinstance(getattr(obj, f.name), kind)
    ]
    return f" It contains one: write {' or '.join(names)} after it." if names else ""


def _check_annotations(obj: Any) -> None:
    """Raise ParameterError if a structural field does not conform to its annotation."""
    hints = {**type_hints(type(obj)), **getattr(obj, "accepted", {})}
    for field in dataclasses.fields(obj):
        component = getattr(obj, field.name)
        hint = hints.get(field.name)
        if "unit" in field.metadata:
            continue
        label = f"{type(obj).__name__}: {field.name}"
        if isinstance(component, int) and abs(component) > _MAX_INTEGER:
            raise ParameterError(
                f"{label} is too large an integer; allowed range: at most {_MAX_INTEGER}."
            )
        if isinstance(component, str) and len(component) > _MAX_CHARACTERS:
            length = f"a text of {len(component)} characters"
            raise ParameterError(f"{label} is {length}; at most {_MAX_CHARACTERS} are allowed.")
        if not conforms(component, hint):
            contained = attribute_hint(component, hint) if isinstance(hint, type) else ""
            raise ParameterError(
                f"{label} must be {describe(hint)}; it is {abridged(component)}.{contained}"
            )
        check_within(obj, field)


def check_structure(obj: Any) -> None:
    """Raise ParameterError if a component, at any depth of a model, is not an instance of its
    field's class.
    """
    for _, part in parts_of(obj):
        _check_annotations(part)


def parts_of(thing: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """A model, or a tuple of models, and all models inside it, each with its path."""
    if isinstance(thing, tuple):
        for i, item in enumerate(thing):
            yield from parts_of(item, f"{path}[{i}]")
    elif is_model(thing):
        yield path, thing
        for field in dataclasses.fields(thing):
            yield from parts_of(
                getattr(thing, field.name), f"{path}.{field.name}" if path else field.name
            )


def check_field(cls: type[Any], name: str) -> None:
    """Raise ParameterError, with the closest field name, if a model class has no field of this
    name.
    """
    known = [f.name for f in dataclasses.fields(cls) if f.init]
    check_known(f"{cls.__name__} has no parameter", one_line(name), known, "its parameters are")
