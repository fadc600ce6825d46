"""The form in which results of tasks are stored: JSON and the bytes of arrays.

A result consists of numbers, texts, lists, tables, arrays, and records: the frozen data classes,
named tuples and enumerations of this program, by their names and fields. Nothing that is read is
called: a record is made from its fields alone.
"""

import dataclasses
import enum
import importlib
import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ..core import AbsolutePressure, AirmuscleError, HintedText
from ..core.annotation import is_model
from .content import PROGRAM

_PLAIN = (bool, int, str, type(None))
_ARRAY_KINDS = "biufcSU"
"""Kinds of the arrays that are stored: numbers, truth values and texts."""
_CONSTANTS = {"missing": dataclasses.MISSING, "ellipsis": ...}
"""Constants in declarations of parameters, by their classes: pickle copies the first of them."""


class NotStorableError(AirmuscleError):
    """A result contains an object that has no stored form."""


def encode(value: Any) -> bytes:
    """The stored form of a result. Raises NotStorableError for an object of another class than
    those of this module's description.
    """
    encoder = _Encoder()
    content = {
        "value": encoder.node(value),
        "records": encoder.records,
        "arrays": encoder.descriptions,
    }
    text = json.dumps(content, ensure_ascii=True, separators=(",", ":"))
    return b"\n".join([text.encode(), b"".join(encoder.blocks)])


def decode(content: bytes) -> Any:
    """The result of a stored form, equal to the last bit. Raises ValueError or another exception
    for contents that `encode` did not make.
    """
    text, _, block = content.partition(b"\n")
    stored = json.loads(text)
    return _Decoder(stored["arrays"], block, stored["records"]).value(stored["value"])


class _Encoder:
    """Arrays and records of one result; what occurs twice is stored once."""

    def __init__(self) -> None:
        self.records: list[Any] = []
        self.descriptions: list[Any] = []
        self.blocks: list[bytes] = []
        self._places: dict[int, dict[str, int]] = {}
        self._alive: list[Any] = []
        self._forms: dict[type, tuple[str, Callable[[Any], Any]]] = {
            tuple: ("tuple", self._nodes),
            AbsolutePressure: ("absolute", lambda value: [value.absolute, value.ambient]),
            HintedText: ("hinted", lambda value: self._nodes(value.parts)),
            Counter: ("counts", self._pairs),
            dict: ("table", self._pairs),
            range: ("range", lambda value: [value.start, value.stop, value.step]),
        }
        """The name of the form of a type, and its contents."""

    def node(self, value: Any) -> Any:
        """The JSON of a value."""
        kind = type(value)
        if kind in _PLAIN or kind is float:
            return value
        if kind is list:
            return self._nodes(value)
        constant = _name_of_constant(value)
        if constant:
            return {"constant": constant}
        form = self._forms.get(kind)
        if form is not None:
            name, contents = form
            return {name: contents(value)}
        if isinstance(value, Mapping) and kind.__module__ == "builtins":
            return {"table": self._pairs(value)}
        if isinstance(value, np.generic):
            return {"number": self._array(np.asarray(value))}
        if isinstance(value, enum.Enum):
            return {"choice": [_class_name(kind), value.name]}
        if isinstance(value, type):
            return {"class": _class_name(value)}
        return self._shared(value)

    def _nodes(self, values: Iterable[Any]) -> list[Any]:
        return [self.node(value) for value in values]

    def _pairs(self, table: Mapping[Any, Any]) -> list[Any]:
        return [[self.node(key), self.node(item)] for key, item in table.items()]

    def _shared(self, value: Any) -> dict[str, int]:
        identity = id(value)
        if identity not in self._places:
            if type(value) is np.ndarray:
                place = {"array": self._array(value)}
            else:
                place = {"record": self._record(value)}
            self._places[identity] = place
            self._alive.append(value)  # so that no other object has its identity
        return self._places[identity]

    def _record(self, value: Any) -> int:
        fields = {name: self.node(item) for name, item in _fields(value).items()}
        self.records.append([_class_name(type(value)), fields])
        return len(self.records) - 1

    def _array(self, array: Any) -> int:
        if array.dtype.kind not in _ARRAY_KINDS:
            raise NotStorableError(f"arrays of {array.dtype} have no stored form")
        # Sums of products depend on the order of rows and columns in memory.
        order = "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"
        self.descriptions.append(
            [array.dtype.str, list(array.shape), order, bool(array.flags.writeable)]
        )
        self.blocks.append(array.tobytes(order=order))
        return len(self.descriptions) - 1


class _Decoder:
    """The values of one stored form."""

    def __init__(self, descriptions: Any, block: bytes, records: Any) -> None:
        self._arrays: list[Any] = []
        place = 0
        for kind, shape, order, writable in descriptions:
            dtype = np.dtype(kind)
            if dtype.kind not in _ARRAY_KINDS:
                raise ValueError(f"arrays of {dtype} are not stored")
            end = place + math.prod(shape) * dtype.itemsize
            values = np.frombuffer(block[place:end], dtype)
            array = values.reshape(shape, order=order).copy(order=order)
            array.setflags(write=writable)
            self._arrays.append(array)
            place = end
        if place != len(block):
            raise ValueError("the arrays have another size than stated")
        self._records: list[Any] = []
        for name, fields in records:
            self._records.append(self._record(_class(name), fields))

    def value(self, node: Any) -> Any:
        """The value of a JSON node."""
        if isinstance(node, list):
            return [self.value(item) for item in node]
        if not isinstance(node, dict):
            return node
        ((kind, content),) = node.items()
        match kind:
            case "tuple":
                return tuple(self.value(item) for item in content)
            case "table":
                return self._table(content)
            case "counts":
                return Counter(self._table(content))
            case "array":
                return self._arrays[content]
            case "record":
                return self._records[content]
            case "number":
                return self._arrays[content][()]
            case "hinted":
                return HintedText(*(self.value(part) for part in content))
            case _:
                return _named_value(kind, content)

    def _table(self, pairs: Any) -> dict[Any, Any]:
        return {self.value(key): self.value(item) for key, item in pairs}

    def _record(self, kind: Any, fields: dict[str, Any]) -> Any:
        values = {name: self.value(node) for name, node in fields.items()}
        if issubclass(kind, tuple):
            return kind._make(values[name] for name in kind._fields)
        made = {field.name: field.default_factory for field in _derived_fields(kind)}
        declared = {field.name for field in dataclasses.fields(kind)}
        if values.keys() | made.keys() != declared:
            raise ValueError(f"the fields of {kind.__name__} are not those stored")
        record = object.__new__(kind)
        for name, make in made.items():
            object.__setattr__(record, name, make())
        for name, value in values.items():
            object.__setattr__(record, name, value)
        return record


def _name_of_constant(value: Any) -> str | None:
    for name, known in _CONSTANTS.items():
        if type(value) is type(known):
            return name
    return None


def _named_value(kind: str, content: Any) -> Any:
    match kind:
        case "constant":
            return _CONSTANTS[content]
        case "absolute":
            return AbsolutePressure(*map(float, content))
        case "range":
            return range(*content)
        case "choice":
            name, member = content
            return _class(name)[member]
        case "class":
            return _class(content)
        case _:
            raise ValueError(f"'{kind}' is no kind of stored value")


def _fields(value: Any) -> dict[str, Any]:
    """The fields of a record by name."""
    kind = type(value)
    if isinstance(value, tuple) and hasattr(kind, "_fields"):
        return dict(zip(kind._fields, value, strict=True))
    if not is_model(value):
        raise NotStorableError(
            f"objects of {kind.__module__}.{kind.__qualname__} have no stored form"
        )
    derived = {field.name for field in _derived_fields(kind)}
    names = [field.name for field in dataclasses.fields(value) if field.name not in derived]
    if "__getstate__" in kind.__dict__:  # fields that are examined before they are handed on
        state = value.__getstate__()
        return {name: state[name] for name in names}
    return {name: getattr(value, name) for name in names}


def _derived_fields(kind: Any) -> list[Any]:
    """The fields that are no arguments and begin empty: what a record keeps of its own results."""
    return [
        field
        for field in dataclasses.fields(kind)
        if not field.init and field.default_factory is not dataclasses.MISSING
    ]


def _class_name(kind: type) -> str:
    if kind.__module__.partition(".")[0] != PROGRAM or "<" in kind.__qualname__:
        raise NotStorableError(
            f"objects of {kind.__module__}.{kind.__qualname__}, which is not of this program, have"
            " no stored form"
        )
    return f"{kind.__module__}:{kind.__qualname__}"


def _class(name: str) -> Any:
    """A data class, named tuple or enumeration of this program. Raises ValueError for another."""
    module, _, path = name.partition(":")
    if module.partition(".")[0] != PROGRAM:
        raise ValueError(f"{name} is not of this program")
    item: Any = importlib.import_module(module)
    for part in path.split("."):
        item = getattr(item, part)
    if not isinstance(item, type):
        raise ValueError(f"{name} is no class")
    return item
