"""Memory of control laws that contain other control laws: named values with a prefix for each part."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.ops import Value


def with_prefix(prefix: str, memory: Mapping[str, Value]) -> dict[str, Value]:
    """The values of one part, with its prefix."""
    return {f"{prefix}.{name}": value for name, value in memory.items()}


def of_part(prefix: str, memory: Mapping[str, Value]) -> dict[str, Value]:
    """The values of one part, without its prefix."""
    start = f"{prefix}."
    return {name.removeprefix(start): value for name, value in memory.items() if name.startswith(start)}


def united(*names: tuple[str, ...]) -> tuple[str, ...]:
    """All names, each once, in their order."""
    return tuple(dict.fromkeys(name for each in names for name in each))
