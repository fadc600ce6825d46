"""Names of a face that are imported on use, from the stub of its package, which type checkers read, too."""

import functools
import importlib
import sys
import types


def attach_stub(package, file):  # type: ignore[no-untyped-def]
    """`__getattr__`, `__dir__` and `__all__` of a package, from the lines `from .x import name as name` of its stub.

    The functions of a room name the argument that is wrong where a call ends in an exception of Python. Nothing else is
    imported: until `__main__.main` runs, an interruption cannot be handled.
    """
    with open(f"{file}i", encoding="ascii") as stub:
        modules = {words[3]: words[1] for words in map(str.split, stub) if words[:1] == ["from"]}

    def get(name):  # type: ignore[no-untyped-def]
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if modules[name] == ".":
            return importlib.import_module(f".{name}", package)
        value = getattr(importlib.import_module(modules[name], package), name)
        if isinstance(value, types.FunctionType) and package.count(".") == 1:
            value = _naming_arguments(value, package)  # type: ignore[no-untyped-call]
        setattr(sys.modules[package], name, value)
        return value

    return get, lambda: sorted(modules), sorted(modules)


def _naming_arguments(function, room):  # type: ignore[no-untyped-def]
    """The function under the name of its room, by which it is pickled."""

    @functools.wraps(function)
    def call(*given, **named):  # type: ignore[no-untyped-def]
        try:
            return function(*given, **named)
        except Exception as failure:
            importlib.import_module(".annotation", __package__).check_arguments(function, given, named, failure)
            raise

    call.__module__ = room
    return call
