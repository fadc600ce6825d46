"""Names of a face that are imported on use, from the stub of its package, which type checkers read,
too.
"""

import importlib
import os
import sys
import types


def attach_stub(package, file):  # type: ignore[no-untyped-def]
    """`__getattr__`, `__dir__` and `__all__` of a package, from the lines `from .x import name as
    name` of its stub.

    Names after `# isort: split` are for the other rooms alone, and not in `__all__`. The functions
    of a room, except `core`, name the argument that is wrong where a call ends in an exception of
    Python. Nothing else is imported: until `__main__.main` runs, an interruption cannot be handled.
    """
    parts = _text(f"{file}i").split("# isort: split")
    imports = [
        [words for words in map(str.split, part.splitlines()) if words[:1] == ["from"]]
        for part in parts
    ]
    modules = {words[3]: words[1] for part in imports for words in part}
    public = sorted(words[3] for words in imports[0])

    def get(name):  # type: ignore[no-untyped-def]
        if name not in modules:
            folders = [] if name.startswith("_") else sorted(os.listdir(os.path.dirname(file)))
            stubs = {
                folder: os.path.join(os.path.dirname(file), folder, "__init__.pyi")
                for folder in folders
            }
            rooms = [
                room
                for room, stub in stubs.items()
                if os.path.isfile(stub) and f" as {name}\n" in _text(stub)
            ]
            place = f"; it is in {package}.{rooms[0]}" if rooms else ""
            raise AttributeError(f"module {package!r} has no attribute {name!r}{place}")
        if modules[name] == ".":
            return importlib.import_module(f".{name}", package)
        value = getattr(importlib.import_module(modules[name], package), name)
        if (
            isinstance(value, types.FunctionType)
            and package.count(".") == 1
            and package != __package__
        ):
            value = _naming_arguments(value, package)  # type: ignore[no-untyped-call]
        setattr(sys.modules[package], name, value)
        return value

    return get, lambda: public, public


def _text(path: str) -> str:
    with open(path, encoding="ascii") as file:
        return file.read()


def _naming_arguments(function, room):  # type: ignore[no-untyped-def]
    """The function under the name of its room, by which it is pickled."""

    @importlib.import_module("functools").wraps(function)
    def call(*positional, **named):  # type: ignore[no-untyped-def]
        try:
            return function(*positional, **named)
        except Exception as failure:
            importlib.import_module(".annotation", __package__).check_arguments(
                function, positional, named, failure
            )
            raise

    call.__module__ = room
    return call
