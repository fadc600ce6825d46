"""Registry of models: the classes that a library file, a scenario or the command line may name as `model`.

It contains every class that is declared with `@model`, unless it has `from_file = False`, and that is listed in the
`__all__` of one of the packages below.
"""

import contextlib
import contextvars
import functools
import importlib
import inspect
import sys
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Any

from ...control import laws
from ...core import Hint, HintedText, UnknownNameError, abridged, one_line, suggestion
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
    if ":" in name and classes is None:
        return _class_of_code(name, where)
    known = _registry() if classes is None else classes
    if name not in known:
        names = tuple(classes) if classes is not None else model_names(kind)
        there = f"; there are {', '.join(names)}." if 0 < len(names) <= MOST_NAMES else "."
        here = "" if names else " A table is due here, not the name of a model."
        raise UnknownNameError(f"{where}: no model '{one_line(name)}'{there}{here}{suggestion(name, known)}")
    return known[name]


_ALLOWED = contextvars.ContextVar("allowed", default=False)


@contextlib.contextmanager
def allow_code() -> Iterator[None]:
    """Within it, files may name a class of a user's module as `model = "module:Class"`, whose code then runs.

    The module is one of the current folder, or installed. Its class is declared with `@model`, as those of the package.
    Read only files of people whom you trust so: the module could do anything.
    """
    token = _ALLOWED.set(True)
    try:
        yield
    finally:
        _ALLOWED.reset(token)


def is_code_allowed() -> bool:
    """Whether files may name classes of a user's module now."""
    return _ALLOWED.get()


def _class_of_code(name: str, where: str) -> type[Any]:
    """The class `module:Class` of a user. Raises UnknownNameError without permission, or where there is none."""
    module, _, attribute = name.partition(":")
    if not is_code_allowed():
        raise UnknownNameError(HintedText(
            f"{where}: '{one_line(name)}' is code of a user. Reading the file would run it, and a file may come from "
            "anywhere, so that it is refused.", Hint("To run it because you trust it", function="files.allow_code"),
        ))  # fmt: skip
    sys.path.insert(0, "")
    try:
        cls = getattr(importlib.import_module(module), attribute)
    except Exception as error:  # whatever the code of the user raises
        raise UnknownNameError(
            f"{where}: '{one_line(name)}' cannot be imported: {type(error).__name__}: {one_line(str(error))}. The "
            "module must be installed, or in the current folder."
        ) from None
    finally:
        sys.path.remove("")
    if not (inspect.isclass(cls) and _is_file_model(cls)):
        raise UnknownNameError(f"{where}: '{one_line(name)}' is no class that is declared with @model.")
    return cls
