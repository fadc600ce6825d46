"""Parameter trees: leaves, flatten and unflatten of frozen models (pytrees).

A declared field of a model is a leaf (a float or a tuple of floats); any other field is structure: another model, a
tuple of models, a whole number, a name. What is derived from a model is stored with the object, so that a variant made
by `dataclasses.replace` derives anew only what changed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from .arrays import Array
from .declaration import Parameter, parameters

T = TypeVar("T")
_STORED = "_tree_node"


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number inside a model: its dotted path, its value and what is declared about it."""

    path: str
    value: Any
    declared: Parameter


class Structure:
    """Everything about a model but the values of its parameters; models of equal structure share one object."""

    __slots__ = ("_parts",)

    def __init__(self, parts: tuple[Any, ...]) -> None:
        self._parts = parts

    def __reduce__(self) -> Any:
        return _intern, (self._parts,)

    def __repr__(self) -> str:
        return f"Structure{self._parts!r}"


class _Node(NamedTuple):
    """The structure of a model, and the values of its leaves in order."""

    structure: Structure
    values: tuple[Any, ...]


_structures: dict[tuple[Any, ...], Structure] = {}


def _intern(parts: tuple[Any, ...]) -> Structure:
    return _structures.setdefault(parts, Structure(parts))


class _Identity:
    """A value that is equal to itself alone."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Identity) and other.value is self.value

    def __hash__(self) -> int:
        return id(self.value)


def _is_hashable(thing: Any) -> bool:
    try:
        hash(thing)
    except TypeError:
        return False
    return True


def _is_model(thing: Any) -> bool:
    return dataclasses.is_dataclass(thing) and not isinstance(thing, type)


def _node(thing: Any) -> _Node:
    """The node of a model, which is stored with it, or of any other value of a structural field."""
    if isinstance(thing, tuple):
        nodes = [_node(item) for item in thing]
        return _Node(_intern((tuple, *(n.structure for n in nodes))), tuple(v for n in nodes for v in n.values))
    if not _is_model(thing):
        return _Node(_intern((type(thing), thing if _is_hashable(thing) else _Identity(thing))), ())
    stored = thing.__dict__.get(_STORED)
    if stored is None:
        stored = _model_node(thing)
        thing.__dict__[_STORED] = stored
    node: _Node = stored
    return node


def _model_node(thing: Any) -> _Node:
    declared = {p.name for p in parameters(thing)}
    parts: list[Any] = [type(thing)]
    values: list[Any] = []
    for field in dataclasses.fields(thing):
        value = getattr(thing, field.name)
        if field.name in declared:
            several = isinstance(value, tuple)
            parts.append((field.name, len(value) if several else 1))
            values += value if several else (value,)
        else:
            node = _node(value)
            parts.append((field.name, node.structure))
            values += node.values
    return _Node(_intern(tuple(parts)), tuple(values))


def structure(thing: Any) -> Structure:
    """The structure of a model; two models of equal structure have the same object, which is a fast key."""
    return _node(thing).structure


def flatten(thing: Any) -> Array:
    """The values of all leaves as one vector, in the order of `leaves`."""
    return np.array(_node(thing).values, dtype=np.float64)


def leaves(thing: Any, path: str = "") -> Iterator[Leaf]:
    """Every declared number of a model and of the models inside it, in a fixed order."""
    if isinstance(thing, tuple):
        for i, item in enumerate(thing):
            yield from leaves(item, f"{path}[{i}]")
    elif _is_model(thing):
        declared = {p.name: p for p in parameters(thing)}
        for field in dataclasses.fields(thing):
            value = getattr(thing, field.name)
            inner = f"{path}.{field.name}" if path else field.name
            if field.name not in declared:
                yield from leaves(value, inner)
            elif isinstance(value, tuple):
                yield from (Leaf(f"{inner}[{i}]", v, declared[field.name]) for i, v in enumerate(value))
            else:
                yield Leaf(inner, value, declared[field.name])


def unflatten(thing: T, values: Sequence[Any]) -> T:
    """The same model with other leaf values, in the order of `leaves`; symbols are put in unchecked."""
    feed = iter(values)
    rebuilt: T = _unflatten(thing, feed)
    return rebuilt


def _unflatten(thing: Any, feed: Iterator[Any]) -> Any:
    if isinstance(thing, tuple):
        return tuple(_unflatten(item, feed) for item in thing)
    if not _is_model(thing):
        return thing
    declared = {p.name for p in parameters(thing)}
    new = object.__new__(type(thing))
    for field in dataclasses.fields(thing):
        value = getattr(thing, field.name)
        if field.name not in declared:
            value = _unflatten(value, feed)
        elif isinstance(value, tuple):
            value = tuple(next(feed) for _ in value)
        else:
            value = next(feed)
        object.__setattr__(new, field.name, value)
    return new


def with_parameters(thing: T, values: Sequence[float]) -> T:
    """The same model with other leaf values, validated like a new object."""
    checked: T = _revalidated(unflatten(thing, [float(v) for v in values]))
    return checked


def _revalidated(thing: Any) -> Any:
    if isinstance(thing, tuple):
        return tuple(_revalidated(item) for item in thing)
    if _is_model(thing):
        return dataclasses.replace(
            thing, **{f.name: _revalidated(getattr(thing, f.name)) for f in dataclasses.fields(thing) if f.init}
        )
    return thing
