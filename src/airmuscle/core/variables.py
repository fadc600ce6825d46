"""Declarations of states and inputs of plant components."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

T = TypeVar("T", "StateVariable", "Input")


@dataclasses.dataclass(frozen=True)
class StateVariable:
    """A state: its name, its unit, and the nominal size below which its relative error does not matter."""

    name: str
    unit: str
    nominal: float
    meaning: str = ""


@dataclasses.dataclass(frozen=True)
class Input:
    """An input: its name, its unit, and the minimum and maximum command."""

    name: str
    unit: str = "1"
    minimum: float = 0.0
    maximum: float = 1.0
    meaning: str = "opening, 0 closed to 1 open"


def add_prefix(prefix: str, variables: tuple[T, ...]) -> tuple[T, ...]:
    """Return the variables with a prefix before each name."""
    return tuple(dataclasses.replace(variable, name=f"{prefix}{variable.name}") for variable in variables)


def select_prefix(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values whose names begin with the prefix, keyed by the remaining names."""
    return {name.removeprefix(prefix): value for name, value in values.items() if name.startswith(prefix)}


def with_prefix(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values with a prefix before each name."""
    return {f"{prefix}{name}": value for name, value in values.items()}


def united(*names: tuple[str, ...]) -> tuple[str, ...]:
    """Return all names, each once, in their order."""
    return tuple(dict.fromkeys(name for each in names for name in each))
