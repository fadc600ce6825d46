"""Registry of models: the classes that a library file, a scenario or the command line may name as `model`.

It contains every class that is declared with `@model`, unless it has `from_file = False`, and that is listed in the
`__all__` of one of the packages below.
"""

from __future__ import annotations

import functools
import inspect
import types
import typing
from collections.abc import Mapping
from typing import Any

from ...control import laws
from ...core.annotation import abridged, one_line
from ...core.errors import UnknownNameError, suggestion
from ...engine import loop, run
from ...physics import mechanism, muscle, plant, pneumatics
from ...physics.muscle import characteristic, friction, geometry

PACKAGES = (characteristic, friction, geometry, laws, loop, mechanism, muscle, plant, pneumatics, run)


@functools.cache
def _registry() -> dict[str, type[Any]]:
    """All model classes by name."""
    exported = {name: getattr(package, name) for package in PACKAGES for name in package.__all__}
    return {name: thing for name, thing in exported.items() if inspect.isclass(thing) and _is_file_model(thing)}


def _is_file_model(cls: type[Any]) -> bool:
    return getattr(cls, "from_file", False) and not inspect.isabstract(cls)


def model_names(kind: Any = Any) -> tuple[str, ...]:
    """Names of all classes that a file may name, sorted; with an annotation `kind`, of those that it allows."""
    return tuple(sorted(name for name, cls in _registry().items() if allows(kind, cls)))


def allows(kind: Any, cls: type[Any]) -> bool:
    """Whether the outermost type of an annotation allows the instances of a class."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return any(allows(option, cls) for option in typing.get_args(kind))
    base = typing.get_origin(kind) or kind
    return kind is Any or (inspect.isclass(base) and issubclass(cls, base))


MOST_NAMES = 40
"""Number of names that a message lists (chosen)."""


def model_class(name: str, where: str, classes: Mapping[str, type[Any]] | None = None, kind: Any = Any) -> type[Any]:
    """The class of this name in `classes`, by default all models.

    UnknownNameError begins with `where` and lists the classes, of all models only those that `kind` allows, if they are
    few.
    """
    if not isinstance(name, str):
        raise UnknownNameError(f'{where} is {abridged(name)}; it must be a name in quotes, such as "Braid".')
    known = _registry() if classes is None else classes
    if name not in known:
        names = tuple(classes) if classes is not None else model_names(kind)
        there = f"; there are {', '.join(names)}." if 0 < len(names) <= MOST_NAMES else "."
        here = "" if names else " A table is due here, not the name of a model."
        raise UnknownNameError(f"{where}: no model '{one_line(name)}'{there}{here}{suggestion(name, known)}")
    return known[name]
