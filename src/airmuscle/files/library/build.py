"""Objects from TOML tables: one reader for muscle, valve, product and plant files, scenarios and
studies.

A table is an object of a dataclass, its keys are the fields. Numbers are in the declared unit or
texts with a unit (`"300 mm"`), tuples are lists, objects inside are tables. `model = "Braid"` names
the class; it may be omitted where only one is possible, and a model without parameters is its name
alone (`gas = "Isothermal"`). A list of numbers may also be a column of a data file, relative to the
folder of the TOML file: `{ file = "data/map.csv", column = "force" }`. The metadata of a field may
state another `key`, and none if it is empty.
"""

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from typing import Any

from ...core import ParameterError, abridged, check_field, parameters
from ...core.annotation import conforms
from ...core.annotation_parts import alternatives, item_type, type_hints
from . import fields
from .fields import allows, has_variants, model_class, model_names
from .files import Location, check_keys, located_errors

Named = Callable[[Any, Location, "TableReader"], Any]
"""The part that a text or a table with `library` names; None if it describes the part itself."""


@dataclasses.dataclass(frozen=True)
class TableReader:
    """Reader of tables as objects.

    classes  the allowed classes by name, for the outermost table; by default all registered models
    known    what the readers of fields declared with `custom_field` are given, such as a unit or a
             plant
    named    readers of parts that may be named instead of described, by their class
    signals  for controllers: the PlantSignals that make what a table does not state, or None
    """

    classes: Mapping[str, type[Any]] | None = None
    known: Any = None
    named: Mapping[type[Any], Named] = dataclasses.field(default_factory=dict)
    signals: Any = None

    def build(
        self,
        table: Any,
        location: Location,
        given: Mapping[str, Any] | None = None,
        *,
        kind: Any = Any,
    ) -> Any:
        """The object that a table describes; `given` are fields that are not read from the table.

        kind  annotation of the place of the object, by which other classes are refused
        """
        part = self._named_part(table, location, kind)
        if part is not None:
            return part
        if isinstance(table, str) and fields.is_table(kind):
            table = {"model": table}
        cls = self._class(table, location, kind)
        given = given or {}
        values, is_named = self._values_of_fields(cls, table, location, given, kind)
        hints = type_hints(cls)
        declared = {p.name: p for p in parameters(cls)}
        signals = self._signals_of(cls)
        parts = signals.parts(cls, hints) if signals else {}
        for name, value in values.items():
            if name not in declared:
                parts[name] = self._part(value, cls, name, hints[name], location)
        fields.check_required(cls, {**values, **parts, **given}, hints, location, is_named)
        numbers = {name: value for name, value in values.items() if name in declared}
        if signals:
            return signals.make(cls, parts, numbers, location)
        if hasattr(cls, "units_of_table"):
            with located_errors(location):
                units = cls.units_of_table(table)
            for name, unit in units.items():
                declared[name] = dataclasses.replace(declared[name], unit=unit)
        numbers = {
            n: fields.read_parameter(v, declared[n], hints[n], location) for n, v in numbers.items()
        }
        with located_errors(location):
            return cls(**parts, **numbers, **given)

    def _signals_of(self, cls: type[Any]) -> Any:
        """What makes the objects of a class by the signals of a plant; None for other classes."""
        return self.signals if self.signals and self.signals.concerns(cls) else None

    def _named_part(self, table: Any, location: Location, kind: Any) -> Any:
        """The object of a table that names one of the library; None for any other table."""
        for cls, read in self.named.items():
            if cls in alternatives(kind):
                part = read(table, location, self)
                if part is not None:
                    return part
        return None

    def _values_of_fields(
        self, cls: type[Any], table: Any, location: Location, given: Mapping[str, Any], kind: Any
    ) -> tuple[dict[str, Any], bool]:
        """The values of a table by the fields that are not given, and whether the table names its
        class. Raises ParameterError for another key.
        """
        names = {f.metadata.get("key", f.name): f.name for f in dataclasses.fields(cls) if f.init}
        values = {key: value for key, value in table.items() if key != "model" or key in names}
        is_named = "model" in table and "model" not in names
        for key in values if is_named else ():
            with located_errors(location):
                check_field(cls, key)
        allowed = [key for key in names if key]
        if any(option in self.named for option in alternatives(kind)):
            allowed.append("library")
        check_keys(values, allowed, location)
        read = {names[key]: value for key, value in values.items() if names[key] not in given}
        return read, is_named

    def _class(self, table: Any, location: Location, kind: Any) -> type[Any]:
        """The class of a table. Raises ParameterError or UnknownNameError."""
        only = only_class(kind) if self.classes is None else None
        if not isinstance(table, Mapping):
            of_kind = "" if kind is Any else f" of {fields.describe_type(kind)}"
            content = f'model = "..."{of_kind} and its parameters in it'
            if only is not None:
                content = f"its values in it: {', '.join(_keys(only))}"
            raise ParameterError(
                f"{location} is {abridged(table)}; it must be a table. Write {content}."
            )
        if only is not None and ("model" not in table or "model" in _keys(only)):
            return only
        if not isinstance(table.get("model"), str):
            choice = ", ".join(self.classes or (() if kind is Any else model_names(kind)))
            example = f"one of {choice}" if choice else 'such as model = "Braid"'
            raise ParameterError(
                f'{location}: the model is not named; write model = "...", {example}, and'
                " parameters."
            )
        cls = model_class(table["model"], f"{location}, model", self.classes, kind)
        if not allows(kind, cls):
            listed = "" if only else f": {', '.join(model_names(kind))}"
            raise ParameterError(
                f"{location}: {cls.__name__} is not allowed here; {fields.describe_type(kind)} is"
                f" required{listed}."
            )
        return cls

    def _part(self, value: Any, cls: type[Any], name: str, hint: Any, location: Location) -> Any:
        """A field without a declared unit: an object, a tuple of them, a number, a text, true or
        false.
        """
        field = cls.__dataclass_fields__[name]
        key = str(field.metadata.get("key", name))
        if "read" in field.metadata:
            return field.metadata["read"](value, self.known, location.at(key))
        return self.value(value, hint, location, key, 1 if "key" in field.metadata else None)

    def value(
        self, value: Any, hint: Any, location: Location, key: str, first: int | None = None
    ) -> Any:
        """The value of a key by an annotation; `first` is the number of the first table of an array
        in messages.
        """
        item = item_type(hint)
        if isinstance(value, list) and item is not None:
            places = [
                f"{key}[{i}]" if first is None else f"{key} {i + first}" for i in range(len(value))
            ]
            return tuple(
                self.value(v, item, location, p) for v, p in zip(value, places, strict=True)
            )
        if conforms(value, hint) and not isinstance(value, Mapping):
            return value
        if fields.describes_tables(hint) or (
            fields.is_table(hint) and isinstance(value, Mapping | str)
        ):
            return self.build(value, location.inside(key), kind=hint)
        if isinstance(value, Mapping) and fields.is_table(item):
            raise ParameterError(
                f"{location}: '{key}' must be an array of tables; write [[{key}]] above each."
            )
        raise ParameterError(
            f"{location}: {key} is {abridged(value)}; it must be {fields.describe_type(hint)}."
        )


build = TableReader().build


def _keys(cls: type[Any]) -> list[str]:
    """The keys of the table of a class."""
    return [
        key for f in dataclasses.fields(cls) if f.init and (key := f.metadata.get("key", f.name))
    ]


def only_class(kind: Any) -> type[Any] | None:
    """The class of a place where only one is possible."""
    classes = [
        option
        for option in alternatives(kind)
        if dataclasses.is_dataclass(option) and inspect.isclass(option)
    ]
    if len(classes) != 1 or inspect.isabstract(classes[0]) or has_variants(classes[0]):
        return None
    return classes[0]
