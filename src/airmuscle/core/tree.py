"""Parameter trees: leaves, flatten and unflatten of frozen models (pytrees); fingerprints of models
and of the program.

A declared field of a model is a leaf (a float or a tuple of floats); any other field is structure:
another model, a tuple of models, a whole number, a name. What is derived from a model is stored
with the object, so that a variant made by `dataclasses.replace` derives anew only what changed.
"""

import dataclasses
import functools
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from .absolute_pressure import AbsolutePressure, at_ambient
from .annotation import is_model
from .arrays import Array
from .declaration import Parameter, parameters
from .units import ABSOLUTE

T = TypeVar("T")
_STORED = "_tree_node"


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number inside a model: its dotted path, its value and its declaration."""

    path: str
    value: Any
    declared: Parameter


class Structure:
    """Everything about a model but the values of its parameters; models of equal structure share
    one object.
    """

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


def _node(obj: Any) -> _Node:
    """The node of a model, which is stored with it, or of any other value of a structural field."""
    if isinstance(obj, tuple):
        nodes = [_node(item) for item in obj]
        return _Node(
            _intern((tuple, *(n.structure for n in nodes))),
            tuple(v for n in nodes for v in n.values),
        )
    kind: Any = type(obj)
    if not is_model(obj):
        try:
            return _Node(_intern((kind, obj)), ())
        except TypeError:  # it cannot be hashed
            return _Node(_intern((kind, _Identity(obj))), ())
    stored: _Node | None = obj.__dict__.get(_STORED)
    if stored is not None:
        return stored
    parts = [kind]
    values = list[Any]()
    for name, declared in _fields(kind) or ():
        value = getattr(obj, name)
        if declared is None:
            node = _node(value)
            parts.append((name, node.structure))
            values += node.values
        else:
            several = isinstance(value, tuple)
            parts.append((name, len(value) if several else 1))
            values += value if several else (value,)
    stored = obj.__dict__[_STORED] = _Node(_intern(tuple(parts)), tuple(values))
    return stored


def structure(obj: Any) -> Structure:
    """Return the structure of a model; models of equal structure share one object, which is a fast
    key.
    """
    return _node(obj).structure


def flatten(obj: Any) -> Array:
    """Return the values of all leaves as one vector, in the order of `leaves`."""
    return np.array(_node(obj).values, dtype=np.float64)


def leaves(obj: Any, path: str = "") -> Iterator[Leaf]:
    """Yield every declared number of a model and of the models inside it, in a fixed order."""
    if isinstance(obj, tuple):
        for i, item in enumerate(obj):
            yield from leaves(item, f"{path}[{i}]")
    else:
        kind: Any = type(obj)
        for name, declared in _fields(kind) or ():
            value = getattr(obj, name)
            inner = f"{path}.{name}" if path else name
            if declared is None:
                yield from leaves(value, inner)
            elif isinstance(value, tuple):
                yield from (Leaf(f"{inner}[{i}]", v, declared) for i, v in enumerate(value))
            else:
                yield Leaf(inner, value, declared)


def unflatten(obj: T, values: Sequence[Any]) -> T:
    """Return the model with other leaf values, in the order of `leaves`; values, such as symbols,
    are not validated.
    """
    rebuilt: T = _unflatten(obj, iter(values))
    return rebuilt


@functools.cache
def _fields(cls: type[Any]) -> tuple[tuple[str, Parameter | None], ...] | None:
    """The fields of a model class, each with its declaration or None; None for any other class."""
    if not dataclasses.is_dataclass(cls):
        return None
    declared = {parameter.name: parameter for parameter in parameters(cls)}
    names = [field.name for field in dataclasses.fields(cls)]
    return tuple((name, declared.get(name)) for name in names)


def _unflatten(obj: Any, values: Iterator[Any]) -> Any:
    if isinstance(obj, tuple):
        return tuple([_unflatten(item, values) for item in obj])
    kind: Any = type(obj)
    fields = _fields(kind)
    if fields is None:
        return obj
    new = object.__new__(type(obj))
    for name, declared in fields:
        value = getattr(obj, name)
        if declared is None:
            value = _unflatten(value, values)
        elif isinstance(value, tuple):
            value = tuple([next(values) for _ in value])
        else:
            value = next(values)
        object.__setattr__(new, name, value)
    return new


def absolute_pressures(obj: Any, varied: Mapping[str, Any]) -> dict[str, Any]:
    """Gauge pressures [Pa] of the leaves that were stated as absolute, by path, where the ambient
    pressure is varied.

    `varied` are the values of the varied leaves by path, numbers or columns; a leaf in it is not
    among the result.
    """
    known = list(leaves(obj))
    ambient = next(
        (varied[x.path] for x in known if x.declared.unit == ABSOLUTE and x.path in varied), None
    )
    stated = [x for x in known if isinstance(x.value, AbsolutePressure) and x.path not in varied]
    return {} if ambient is None else {x.path: x.value.absolute - ambient for x in stated}


def with_parameters(obj: T, values: Sequence[float]) -> T:
    """Return the model with other leaf values, validated like a new object. Raises
    ParameterError.
    """
    checked: T = _revalidate(
        unflatten(obj, [v if isinstance(v, AbsolutePressure) else float(v) for v in values])
    )
    return checked


def with_ambient(obj: T, ambient: float) -> T:
    """Return the model with its absolute pressures converted with an ambient pressure [Pa]; `obj`
    if that is so.

    Raises ParameterError for a gauge pressure that is out of bounds.
    """
    values = _node(obj).values
    if all(value.ambient == ambient for value in values if isinstance(value, AbsolutePressure)):
        return obj
    return with_parameters(obj, [at_ambient(value, ambient) for value in values])


def _revalidate(obj: Any) -> Any:
    if isinstance(obj, tuple):
        return tuple(_revalidate(item) for item in obj)
    if is_model(obj):
        return dataclasses.replace(
            obj,
            **{
                f.name: _revalidate(getattr(obj, f.name)) for f in dataclasses.fields(obj) if f.init
            },
        )
    return obj


PACKAGE_ROOT = Path(__file__).parents[1]
EXCLUDED_ROOMS = ("outlets", "papers", "report")
"""Rooms of the program that do not affect a simulation."""
NUMERICAL_PACKAGES = ("numpy", "scipy", "numba", "llvmlite")


def fingerprint(*objects: Any) -> str:
    """A SHA-256 digest (64 hexadecimal digits) of numbers, texts, tables and models; any change
    changes it.
    """
    text = json.dumps(
        [_to_json(item) for item in objects], ensure_ascii=False, separators=(",", ":")
    )
    return hashlib.sha256(text.encode()).hexdigest()


def _to_json(value: Any) -> Any:
    """An object as JSON data, with bit-exact numbers."""
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float):
        return float(value).hex()
    if isinstance(value, np.ndarray):
        return [
            str(value.dtype),
            value.shape,
            hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest(),
        ]
    if isinstance(value, Mapping):
        return {"keys": [[_to_json(k), _to_json(v)] for k, v in value.items()]}
    if isinstance(value, list | tuple):
        return [_to_json(item) for item in value]
    if is_model(value):
        fields = {f.name: _to_json(getattr(value, f.name)) for f in dataclasses.fields(value)}
        module = type(value).__module__
        package = (
            "airmuscle" if module.startswith("airmuscle.") else module
        )  # whose public names are unique
        return [f"{package}.{type(value).__qualname__}", fields]
    return repr(value)  # such as a date in a TOML file


@functools.cache
def program_fingerprint(excluded: tuple[str, ...] = EXCLUDED_ROOMS) -> str:
    """The fingerprint of the program: its version, its source files, and the versions of the
    numerical packages.

    excluded  rooms of the program that do not affect the results; by default those of a simulation
    """
    files = [
        p
        for p in sorted(PACKAGE_ROOT.rglob("*.py"))
        if p.relative_to(PACKAGE_ROOT).parts[0] not in excluded
    ]
    contents = [
        (p.relative_to(PACKAGE_ROOT).as_posix(), hashlib.sha256(p.read_bytes()).hexdigest())
        for p in files
    ]
    found = [item for name in NUMERICAL_PACKAGES for item in metadata.distributions(name=name)]
    versions = [(package.name, package.version) for package in found]
    return fingerprint(metadata.version("airmuscle"), contents, versions)
