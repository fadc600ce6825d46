"""What belongs to one of a circuit's muscles: by the number of its port inside, by the muscle's name outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

T = TypeVar("T")


def port_prefix(number: int) -> str:
    """What the names of a port's quantities begin with, where a circuit has several; counted from 1."""
    return f"port{number}."


def key_by_muscle(prefixes: Sequence[str], values: Mapping[str, T]) -> dict[str, T]:
    """The values of a circuit, those of port i under the prefix of muscle i."""
    return {_replace_port_prefix(name, prefixes): value for name, value in values.items()}


def key_by_port(prefixes: Sequence[str], values: Mapping[str, T]) -> dict[str, T]:
    """The values of a plant, those under the prefix of muscle i under that of port i too."""
    found = dict(values)
    for number, prefix in enumerate(prefixes, 1):
        found |= {port_prefix(number) + n.removeprefix(prefix): v for n, v in values.items() if n.startswith(prefix)}
    return found


def _replace_port_prefix(name: str, prefixes: Sequence[str]) -> str:
    for number, prefix in enumerate(prefixes, 1):
        if name.startswith(port_prefix(number)):
            return prefix + name.removeprefix(port_prefix(number))
    return name
