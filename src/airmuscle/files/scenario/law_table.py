"""Tables of controllers that contain other controllers: laws, sensors and models of the plant, at any depth.

[input.controller]
model = "Cascade"
minimum = ["0 bar"]                         in the unit of the outer command
maximum = ["5 bar"]
[input.controller.outer]                    a law is a table; a list of laws is an array of tables
model = "PID"
[input.controller.inner]
model = "PID"

Numbers are SI or texts with a unit that fits the signals of the law in whose table they are. Muscles and mechanism of a
static inverse are those of the plant unless the table gives others, in the form of [plant].
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from typing import Any

from ...core.declaration import Parameter, check_field, parameters
from ...core.errors import ParameterError
from ...core.units import is_known_unit
from ...engine.loop.control_loop import check_present
from ...engine.loop.controller import RELATIVE, Controller, SignalRelated, named_signal_units, unit_of
from ...physics.mechanism.base import Mechanism
from ...physics.muscle import Muscle
from ...physics.plant.plant import Plant
from ..library.build import build
from ..library.fields import accepts, check_required, describe_type, item_type, read_parameter
from ..library.location import Location, located_errors
from ..library.models import model_class, model_names
from ..library.plant_file import build_muscle


def build_law(table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], location: Location) -> Controller:
    """The controller of a table, with the laws inside it; `units` are those of the signals of the plant by name.

    The table is read twice: the first time without its numbers, to find the signals that determine their units.
    Raises ParameterError, UnitError or UnknownNameError with the location.
    """
    if isinstance(table.get("model"), str):
        cls = model_class(table["model"], f"{location}, model", kind=Controller)
        if not issubclass(cls, Controller):
            known = ", ".join(model_names(Controller))
            raise ParameterError(f"{location}: {cls.__name__} is not a controller; there are {known}.")
    outline = _LawTable(plant, None).model(table, location)
    with located_errors(location):
        check_present(outline, [name for name in units if name not in plant.inputs], plant.inputs)
        named = named_signal_units(outline)
        signals = {**named, **{name: unit or named.get(name, "") for name, unit in units.items()}}
    controller: Controller = _LawTable(plant, signals).model(table, location)
    return controller


@dataclasses.dataclass(frozen=True)
class _LawTable:
    """Reader of the tables of a controller; without units it makes models whose numbers are not read."""

    plant: Plant
    units: Mapping[str, str] | None

    def model(self, table: Any, location: Location, kind: Any = Controller) -> Any:
        """The model of a table; one that does not depend on signals is built as in any other table."""
        cls = self._class(table, location, kind)
        if not issubclass(cls, SignalRelated) and not _contains_plant(cls):
            return build(table, location, kind=kind)
        hints = typing.get_type_hints(cls)
        fields = {key: value for key, value in table.items() if key != "model"}
        for key in fields:
            with located_errors(location):
                check_field(cls, key)
        declared = {p.name: p for p in parameters(cls)}
        parts = self._of_plant(cls, hints) | {
            key: self._part(value, hints[key], key, location) for key, value in fields.items() if key not in declared
        }
        check_required(cls, {**fields, **parts}, hints, location)
        outline = _outline(cls, parts)
        if self.units is None:
            return outline
        numbers = {key: self._number(value, declared[key], hints[key], outline, location)
                   for key, value in fields.items() if key in declared}  # fmt: skip
        with located_errors(location):
            return cls(**parts, **numbers)

    def _class(self, table: Any, location: Location, kind: Any) -> type[Any]:
        if not isinstance(table, Mapping) or not isinstance(table.get("model"), str):
            build(table, location)  # raises the error of a table without a model
        return model_class(table["model"], f"{location}, model", kind=kind)

    def _of_plant(self, cls: type[Any], hints: Mapping[str, Any]) -> dict[str, Any]:
        """Muscles and mechanism of the plant, for the fields of a static inverse that need them."""
        own = {tuple[Muscle, ...]: self.plant.muscles, Mechanism: self.plant.mechanism}
        return {name: own[hints[name]] for name in plant_fields(cls)}

    def _part(self, value: Any, hint: Any, key: str, location: Location) -> Any:
        """A structural field: a model, a tuple of them, an integer, a text, true or false."""
        inner = location.inside(key)
        if isinstance(value, list):
            return tuple(self._part(v, item_type(hint), f"{key}[{i}]", location) for i, v in enumerate(value))
        part = value
        if _is_muscle(hint, value):
            part = build_muscle(value, inner)
        elif isinstance(value, Mapping):
            part = self.model(value, inner, hint)
        elif isinstance(value, str) and not accepts(hint, value):
            part = self.model({"model": value}, inner, hint)
        if not accepts(hint, part):
            what = type(part).__name__ if dataclasses.is_dataclass(part) else repr(part)
            raise ParameterError(f"{location}: {key} is {what}; it must be {describe_type(hint)}.")
        return part

    def _number(self, value: Any, declared: Parameter, hint: Any, outline: Any, location: Location) -> Any:
        """A declared parameter in SI units, read in the units of the signals of its law."""
        units = self.units or {}
        several = isinstance(value, list) and typing.get_origin(hint) is tuple
        if isinstance(outline, Controller) and declared.unit in RELATIVE:
            names = outline.inputs
            if len({units.get(name) for name in names}) > 1:
                raise ParameterError(
                    f"{location}: {' and '.join(names)} have different units; choose inputs of the same unit."
                )
        if not several:
            return _read(value, declared, self._unit(value, declared, 0, outline, location), hint, location)
        return tuple(
            _read(item, dataclasses.replace(declared, name=f"{declared.name}[{i}]"),
                  self._unit(item, declared, i, outline, location), float, location)
            for i, item in enumerate(value)
        )  # fmt: skip

    def _unit(self, value: Any, declared: Parameter, index: int, outline: Any, location: Location) -> str:
        """The unit of a parameter; "1" for a number without a unit where that of a signal is not known."""
        try:
            return unit_of(outline, declared, index, self.units or {})
        except KeyError as error:
            if isinstance(value, str):
                raise ParameterError(
                    f"{location}, {declared.name} is {value!r}; the unit of the signal {error} is not known, because "
                    "it is no column or input of the plant. Correct the name, or give a number in SI units."
                ) from None
            return "1"


def _read(value: Any, declared: Parameter, unit: str, hint: Any, location: Location) -> Any:
    """A number or a column of a file; a unit that depends on no signal is no unit of a text."""
    if isinstance(value, str) and not is_known_unit(unit):
        raise ParameterError(
            f"{location}, {declared.name} is {value!r}; it must be a number in SI units, without a unit "
            f"({declared.symbol}, {declared.meaning})."
        )
    return read_parameter(value, dataclasses.replace(declared, unit=unit), hint, location)


def _outline(cls: type[Any], parts: Mapping[str, Any]) -> Any:
    """A model with its structural fields, whose numbers are defaults or 0; it is not validated."""
    outline = object.__new__(cls)
    for field in dataclasses.fields(cls):
        default = 0.0 if field.default is dataclasses.MISSING else field.default
        object.__setattr__(outline, field.name, parts.get(field.name, default))
    return outline


def plant_fields(cls: type[Any]) -> tuple[str, ...]:
    """The fields of a model that are those of the plant where a table does not give them."""
    hints = typing.get_type_hints(cls)
    if tuple[Muscle, ...] not in hints.values():
        return ()
    return tuple(f.name for f in dataclasses.fields(cls) if hints[f.name] in (tuple[Muscle, ...], Mechanism))


def _contains_plant(cls: type[Any]) -> bool:
    """Whether a model has muscles or a mechanism as a field."""
    return any(_has(hint, kind) for hint in typing.get_type_hints(cls).values() for kind in (Muscle, Mechanism))


def _has(hint: Any, kind: type[Any]) -> bool:
    return hint is kind or any(_has(option, kind) for option in typing.get_args(hint))


def _is_muscle(hint: Any, value: Any) -> bool:
    """Whether a value names or describes a muscle where one is allowed."""
    if not _has(hint, Muscle):
        return False
    return isinstance(value, str) or (
        isinstance(value, Mapping) and ("library" in value or value.get("model") == "Muscle")
    )
