"""What a component brings into a plant: states that are integrated, and inputs that are commanded."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

T = TypeVar("T", "StateVariable", "Input")


@dataclasses.dataclass(frozen=True)
class StateVariable:
    """One state: its name, its unit, and the size below which its relative error no longer matters."""

    name: str
    unit: str
    nominal: float
    meaning: str = ""


@dataclasses.dataclass(frozen=True)
class Input:
    """One input: its name, its unit, and the least and greatest value that may be commanded."""

    name: str
    unit: str = "1"
    minimum: float = 0.0
    maximum: float = 1.0
    meaning: str = "opening, 0 shut to 1 open"


def add_prefix(prefix: str, variables: tuple[T, ...]) -> tuple[T, ...]:
    """The same variables, each with a prefix before its name."""
    return tuple(dataclasses.replace(variable, name=f"{prefix}{variable.name}") for variable in variables)


def select_prefix(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values whose name begins with the prefix, by the rest of their names."""
    return {name.removeprefix(prefix): value for name, value in values.items() if name.startswith(prefix)}


def with_prefix(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values with a prefix before every name."""
    return {f"{prefix}{name}": value for name, value in values.items()}
