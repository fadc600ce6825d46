"""Parameter trees: leaves, flatten and unflatten of frozen models (pytrees)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from .declaration import Parameter, parameters

T = TypeVar("T")


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number inside a model: its dotted path, its value and its declaration."""

    path: str
    value: Any
    declared: Parameter


def leaves(obj: Any, path: str = "") -> Iterator[Leaf]:
    """Yield every declared number of a model and of the models inside it, in a fixed order."""
    if isinstance(obj, tuple):
        for i, item in enumerate(obj):
            yield from leaves(item, f"{path}[{i}]")
    elif dataclasses.is_dataclass(obj) and not isinstance(obj, type):
        declared = {p.name: p for p in parameters(obj)}
        for field in dataclasses.fields(obj):
            value = getattr(obj, field.name)
            inner = f"{path}.{field.name}" if path else field.name
            if field.name not in declared:
                yield from leaves(value, inner)
            elif isinstance(value, tuple):
                yield from (Leaf(f"{inner}[{i}]", v, declared[field.name]) for i, v in enumerate(value))
            else:
                yield Leaf(inner, value, declared[field.name])


def flatten(obj: Any) -> npt.NDArray[np.float64]:
    """Return the values of all leaves as one vector, in the order of `leaves`."""
    return np.array([leaf.value for leaf in leaves(obj)], dtype=np.float64)


def structure(obj: Any) -> Any:
    """Return a hashable description of a model without the values of its parameters."""
    if isinstance(obj, tuple):
        return tuple(structure(item) for item in obj)
    if not dataclasses.is_dataclass(obj) or isinstance(obj, type):
        return obj
    declared = {p.name for p in parameters(obj)}
    fields = []
    for field in dataclasses.fields(obj):
        value = getattr(obj, field.name)
        size = len(value) if isinstance(value, tuple) else 1
        fields.append((field.name, size) if field.name in declared else (field.name, structure(value)))
    return (type(obj), *fields)


def unflatten(obj: T, values: Sequence[Any]) -> T:
    """Return the model with other leaf values, in the order of `leaves`; values, such as symbols, are not validated."""
    rebuilt: T = _rebuild(obj, iter(values))
    return rebuilt


def _rebuild(obj: Any, values: Iterator[Any]) -> Any:
    """Return a copy whose leaves are taken from the iterator."""
    if isinstance(obj, tuple):
        return tuple(_rebuild(item, values) for item in obj)
    if not dataclasses.is_dataclass(obj) or isinstance(obj, type):
        return obj
    declared = {p.name for p in parameters(obj)}
    new = object.__new__(type(obj))
    for field in dataclasses.fields(obj):
        value = getattr(obj, field.name)
        if field.name not in declared:
            value = _rebuild(value, values)
        elif isinstance(value, tuple):
            value = tuple(next(values) for _ in value)
        else:
            value = next(values)
        object.__setattr__(new, field.name, value)
    return new


def with_parameters(obj: T, values: Sequence[float]) -> T:
    """Return the model with other leaf values, validated like a new object. Raises ParameterError."""
    validated: T = _revalidate(unflatten(obj, [float(v) for v in values]))
    return validated


def _revalidate(obj: Any) -> Any:
    """Return a copy constructed anew at every level, so that every validation runs."""
    if isinstance(obj, tuple):
        return tuple(_revalidate(item) for item in obj)
    if dataclasses.is_dataclass(obj) and not isinstance(obj, type):
        return dataclasses.replace(obj, **{f.name: _revalidate(getattr(obj, f.name)) for f in dataclasses.fields(obj)})
    return obj
