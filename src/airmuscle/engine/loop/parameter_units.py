"""Units of the signals and of the parameters of a controller and of the laws inside it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from ...core.declaration import Parameter, parameters
from .controller import Controller, SignalRelated


def named_signal_units(controller: Any) -> dict[str, str]:
    """Units of the signals that a controller and the laws inside it name, and that are no columns of a plant."""
    return {name: unit for part in _parts(controller, "") for name, unit in _named(part[1]).items()}


def parameter_units(controller: Any, units: Mapping[str, str]) -> dict[str, str]:
    """The unit of every number of a controller by its path, those inside it included.

    `units` are those of the columns and inputs of the plant by name; units of further signals are added. It is "1"
    where the unit of a signal is not known.
    """
    named = named_signal_units(controller)
    known = {**named, **{name: unit or named.get(name, "") for name, unit in units.items()}}
    unit_of_each: dict[str, str] = {}
    for path, part in _parts(controller, ""):
        for declared in parameters(part):
            name = f"{path}.{declared.name}" if path else declared.name
            value = getattr(part, declared.name)
            if isinstance(value, tuple):
                unit_of_each |= {f"{name}[{i}]": _unit_or_one(part, declared, i, known) for i in range(len(value))}
            else:
                unit_of_each[name] = _unit_or_one(part, declared, 0, known)
    return unit_of_each


def unit_of(part: Any, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
    """The unit of item `index` of a declared parameter of a controller or of a model inside it.

    Raises KeyError for a signal whose unit is not given.
    """
    return part.unit_of(declared, index, units) if isinstance(part, SignalRelated) else declared.unit


def _unit_or_one(part: Any, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
    try:
        return unit_of(part, declared, index, units)
    except KeyError:
        return "1"


def _named(part: Any) -> Mapping[str, str]:
    return part.signal_units if isinstance(part, Controller) else {}


def _parts(thing: Any, path: str) -> Iterator[tuple[str, Any]]:
    """A model and all models inside it, each with its path."""
    if isinstance(thing, tuple):
        for i, item in enumerate(thing):
            yield from _parts(item, f"{path}[{i}]")
    elif dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        yield path, thing
        for field in dataclasses.fields(thing):
            if "unit" not in field.metadata:
                yield from _parts(getattr(thing, field.name), f"{path}.{field.name}" if path else field.name)
