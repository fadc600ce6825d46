"""Port prefixes: names of the quantities of one muscle inside a circuit (by port) and in a plant (by muscle)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

T = TypeVar("T")


def port_prefix(number: int) -> str:
    """Prefix of the names that belong to a port, counted from 1, of a circuit with several ports."""
    return f"port{number}."


def key_by_muscle(prefixes: Sequence[str], values: Mapping[str, T]) -> dict[str, T]:
    """The values of a circuit, with the prefix of port i replaced by that of muscle i."""
    return {_replace_port_prefix(name, prefixes): value for name, value in values.items()}


def key_by_port(prefixes: Sequence[str], values: Mapping[str, T]) -> dict[str, T]:
    """The values of a plant; those with the prefix of muscle i are repeated with the prefix of port i."""
    keyed = dict(values)
    for number, prefix in enumerate(prefixes, 1):
        keyed |= {port_prefix(number) + n.removeprefix(prefix): v for n, v in values.items() if n.startswith(prefix)}
    return keyed


def _replace_port_prefix(name: str, prefixes: Sequence[str]) -> str:
    for number, prefix in enumerate(prefixes, 1):
        if name.startswith(port_prefix(number)):
            return prefix + name.removeprefix(port_prefix(number))
    return name
