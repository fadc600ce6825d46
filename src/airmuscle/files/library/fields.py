"""Fields of an object in a TOML table: their declaration, the reading of numbers, and the models
that it may name.

The registry of models contains every class that is declared with `@model`, unless it has `from_file
= False`, and that is listed in the `__all__` of one of the packages below.
"""

import contextlib
import contextvars
import dataclasses
import functools
import importlib
import inspect
import sys
import types
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from ... import bench
from ...control import estimation, laws
from ...core import (
    Hint,
    HintedText,
    Parameter,
    ParameterError,
    UnknownNameError,
    abridged,
    one_line,
    suggestion,
)
from ...core.annotation_parts import alternatives, item_type, origin, type_hints
from ...engine import loop, run
from ...physics import mechanism, muscle, plant, pneumatics
from ...physics.muscle import characteristic, friction, geometry
from .files import Location, located_errors, read_number

PACKAGES = (
    characteristic,
    estimation,
    friction,
    geometry,
    laws,
    loop,
    mechanism,
    muscle,
    plant,
    pneumatics,
    run,
)


@functools.cache
def _models(*packages: ModuleType) -> dict[str, type[Any]]:
    """The model classes of packages by name; their modules are imported."""
    return {
        n: cls
        for package in packages
        for n in package.__all__
        if _is_file_model(cls := getattr(package, n))
    }


def _is_file_model(cls: Any) -> bool:
    return inspect.isclass(cls) and getattr(cls, "from_file", False) and not inspect.isabstract(cls)


@functools.cache
def model_names(kind: Any = Any) -> tuple[str, ...]:
    """Names of all classes that a file may name, sorted; with an annotation `kind`, of those that
    it allows.
    """
    return tuple(sorted(name for name, cls in _models(*PACKAGES).items() if allows(kind, cls)))


def has_variants(cls: type[Any]) -> bool:
    """Whether a file may name a subclass of a class; such stand in the package of the class. A
    class that a file may name has none: it is a leaf.
    """
    if _is_file_model(cls):
        return False
    packages = [package for package in PACKAGES if cls.__name__ in package.__all__]
    return any(model is not cls and issubclass(model, cls) for model in _models(*packages).values())


def allows(kind: Any, cls: type[Any]) -> bool:
    """Whether the outermost type of an annotation allows the instances of a class."""
    bases = map(origin, alternatives(kind))
    return kind is Any or any(inspect.isclass(base) and issubclass(cls, base) for base in bases)


MOST_NAMES = 40
"""Number of names that a message lists (chosen)."""


def model_class(
    name: str, where: str, classes: Mapping[str, type[Any]] | None = None, kind: Any = Any
) -> type[Any]:
    """The class of this name in `classes`, by default all models.

    UnknownNameError begins with `where` and lists the classes, of all models only those that `kind`
    allows, if they are few.
    """
    if not isinstance(name, str):
        raise UnknownNameError(
            f'{where} is {abridged(name)}; it must be a name in quotes, such as "Braid".'
        )
    if ":" in name and classes is None:
        return _class_of_code(name, where)
    known = _named_model(name) if classes is None else classes
    if name not in known:
        known = _models(*PACKAGES) if classes is None else classes
        names = tuple(classes) if classes is not None else model_names(kind)
        there = f"; there are {', '.join(names)}." if 0 < len(names) <= MOST_NAMES else "."
        here = "" if names else " A table is due here, not the name of a model."
        raise UnknownNameError(
            f"{where}: no model '{one_line(name)}'{there}{here}{suggestion(name, known)}"
        )
    return known[name]


def _named_model(name: str) -> dict[str, type[Any]]:
    """The model of this name, whose module alone is imported; empty if there is none."""
    package = next((candidate for candidate in PACKAGES if name in candidate.__all__), None)
    cls: Any = getattr(package, name, None)
    return {name: cls} if _is_file_model(cls) else {}


def is_model_name(name: str) -> bool:
    """Whether a file may name a model of this package so."""
    return bool(_named_model(name))


_ALLOWED = contextvars.ContextVar("allowed", default=False)


@contextlib.contextmanager
def allow_code() -> Iterator[None]:
    """Within it, files may name a class of a user's module as `model = "module:Class"`, whose code
    then runs.

    The module is one of the current folder, or installed. Its class is declared with `@model`, as
    those of the package. Read only files of people whom you trust so: the module could do anything.
    """
    token = _ALLOWED.set(True)
    folders = {str(Path.cwd())}.difference(sys.path)
    sys.path += folders  # which worker processes take over, as they import the module too
    try:
        yield
    finally:
        sys.path[:] = (folder for folder in sys.path if folder not in folders)
        _ALLOWED.reset(token)


def model_name(cls: type[Any]) -> str:
    """The name of a class in a file; that of a user has its module before it."""
    return (
        cls.__name__
        if cls.__module__.startswith("airmuscle.")
        else f"{cls.__module__}:{cls.__name__}"
    )


def is_code_allowed() -> bool:
    """Whether files may name classes of a user's module now."""
    return _ALLOWED.get()


def _class_of_code(name: str, where: str) -> type[Any]:
    """The class `module:Class` of a user. Raises UnknownNameError without permission, or where
    there is none.
    """
    module, _, attribute = name.partition(":")
    if not is_code_allowed():
        raise UnknownNameError(
            HintedText(
                f"{where}: '{one_line(name)}' is code of a user. Reading the file would run it, and"
                " a file may come from anywhere, so that it is refused.",
                Hint("To run it because you trust it", function="files.allow_code"),
            )
        )
    sys.path.insert(0, "")
    try:
        cls = getattr(importlib.import_module(module), attribute)
    except Exception as error:  # whatever the code of the user raises
        raise UnknownNameError(
            f"{where}: '{one_line(name)}' cannot be imported: {type(error).__name__}:"
            f" {one_line(str(error))}. The module must be installed, or in the current folder."
        ) from None
    finally:
        sys.path.remove("")
    if not _is_file_model(cls):
        raise UnknownNameError(
            f"{where}: '{one_line(name)}' is no class that is declared with @model."
        )
    model: type[Any] = cls
    if dataclasses.fields(model) and not type_hints(model):
        why = (
            "an annotation is of a name that the module does not import, or imports for type"
            " checkers alone"
        )
        raise UnknownNameError(f"{where}: the fields of '{one_line(name)}' are unknown: {why}.")
    return model


Reader = Callable[[Any, Any, Location], Any]
"""Reads the value of a field, given what the reader of the table knows, and the location of the
value.
"""
_TYPE_NAMES = {int: "an integer", str: "a text in quotes", bool: "true or false", float: "a number"}
_ITEMS = {str: ' of texts, such as ["pressure", "force"]', float: " of numbers"}
_PLAIN = (int, float, str, bool, tuple, types.NoneType)


def custom_field(read: Reader, meaning: str, **field: Any) -> Any:
    """Declare a dataclass field that `read` reads from a file, instead of a parameter with a fixed
    unit.
    """
    return dataclasses.field(metadata={"read": read, "meaning": meaning}, **field)


def is_required(field: dataclasses.Field[Any]) -> bool:
    """Whether a dataclass cannot be made without a field."""
    return (
        field.init
        and field.default is dataclasses.MISSING
        and field.default_factory is dataclasses.MISSING
    )


def check_required(
    cls: type[Any],
    stated: Mapping[str, Any],
    hints: Mapping[str, Any],
    location: Location,
    is_named: bool,
) -> None:
    """Raise ParameterError if a required field is not given, or blank; `is_named`: the table names
    the class.
    """
    for field in dataclasses.fields(cls):
        value = stated.get(field.name)
        if not is_required(field) or (
            field.name in stated and not (isinstance(value, str) and not value.strip())
        ):
            continue
        key = field.metadata.get("key", field.name)
        hint = hints[field.name]
        if is_named:
            facts = field.metadata
            unit = f"[{facts['unit']}] ({facts['symbol']}, " if "unit" in facts else "("
            text = (
                f"{cls.__name__} needs '{key}'"
                f" {unit}{facts.get('meaning') or describe_type(hint)}); it is missing"
            )
        elif "meaning" in field.metadata:
            text = f"'{key}' is missing: {field.metadata['meaning']}"
        else:
            what = f"the table [{key}]" if describes_tables(hint) else f"'{key}'"
            text = f"{what} is missing; it must be {describe_type(hint)}"
        raise ParameterError(f"{location}: {text}.")


def read_parameter(value: Any, declared: Parameter, hint: Any, location: Location) -> Any:
    """Value of a declared parameter [SI]: a number, or of a tuple a list of numbers or a column of
    a data file.
    """
    where = location.at(declared.name)
    many = origin(hint) is tuple
    unit = declared.unit
    about = f" ({declared.symbol}, {declared.meaning})"
    if isinstance(value, Mapping) and many:  # a column of a data file, in the SI unit of recordings
        if set(value) != {"file", "column"} or not all(isinstance(v, str) for v in value.values()):
            example = 'write a column of a file as { file = "data/map.csv", column = "force" }'
            raise ParameterError(f"{where} is {abridged(value)}; {example}.")
        with located_errors(where):
            return tuple(
                float(v) for v in bench.read_csv(where.folder / value["file"])[value["column"]]
            )
    if isinstance(value, list) != many:
        expected = "a list of numbers" if many else "one number"
        raise ParameterError(
            f"{where} is {abridged(value)}; it must be {expected} in {unit}{about}."
        )
    if many:
        return tuple(
            read_number(item, unit, f"{where}[{i}]", about) for i, item in enumerate(value)
        )
    return read_number(value, unit, where, about)


def is_table(hint: Any) -> bool:
    """Whether an annotation allows an object that a table describes."""
    return hint is not None and any(origin(option) not in _PLAIN for option in alternatives(hint))


def describes_tables(hint: Any) -> bool:
    """Whether an annotation allows only objects that tables describe, one or a list."""
    return is_table(hint) and all(
        origin(o) not in _PLAIN or o in (tuple, types.NoneType) or origin(o) is tuple
        for o in alternatives(hint)
    )


def describe_type(hint: Any) -> str:
    """Description of an annotation in words, for error messages: 'a number', 'a Valve or a list of
    texts'.
    """
    words = []
    for option in alternatives(hint):
        if origin(option) is tuple:
            words.append(f"a list{_ITEMS.get(item_type(option), '')}")
        elif option is not types.NoneType:
            name = str(getattr(origin(option), "__name__", origin(option)))
            words.append(
                _TYPE_NAMES.get(origin(option)) or f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"
            )
    return " or ".join(words)
