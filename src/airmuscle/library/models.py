"""Registry of models: the classes that a library file, a scenario or the command line may name as `model`.

Every class that is declared with `@model`, unless it says `from_file = False`, and that one of these packages lists in
its `__all__`.
"""

from __future__ import annotations

import functools
import importlib
import inspect
from collections.abc import Mapping
from typing import Any

from ..core.errors import UnknownNameError, suggestion

PACKAGES = (
    "characteristic", "control", "friction", "geometry", "mechanism", "muscle", "plant", "pneumatics", "simulation",
)  # fmt: skip


@functools.cache
def _registry() -> dict[str, type[Any]]:
    """Every model class by its name."""
    listed: dict[str, Any] = {}
    for package in PACKAGES:
        module = importlib.import_module(f"airmuscle.{package}")
        listed |= {name: getattr(module, name) for name in module.__all__}
    return {name: thing for name, thing in listed.items() if inspect.isclass(thing) and _from_file(thing)}


def _from_file(cls: type[Any]) -> bool:
    return getattr(cls, "from_file", False) and not inspect.isabstract(cls)


def model_names() -> tuple[str, ...]:
    """Every class that a file may name, sorted."""
    return tuple(sorted(_registry()))


def model_class(name: str, where: str, classes: Mapping[str, type[Any]] | None = None) -> type[Any]:
    """The class of this name in `classes`, by default all models; `where` opens the message of UnknownNameError."""
    if not isinstance(name, str):
        raise UnknownNameError(f'{where} is {name!r}; it must be a name in quotes, like "Braid".')
    known = _registry() if classes is None else classes
    if name not in known:
        names = model_names() if classes is None else tuple(classes)
        raise UnknownNameError(f"{where}: no model '{name}'; there are {', '.join(names)}.{suggestion(name, known)}")
    return known[name]
