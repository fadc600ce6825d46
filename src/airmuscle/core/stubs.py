"""Names of a face that are imported on use, from the stub of its package, which type checkers read, too."""

import importlib
import sys


def attach_stub(package, file):  # type: ignore[no-untyped-def]
    """`__getattr__`, `__dir__` and `__all__` of a package, from the lines `from .x import name as name` of its stub.

    Nothing else is imported: until `__main__.main` runs, an interruption cannot be handled.
    """
    with open(f"{file}i", encoding="ascii") as stub:
        modules = {words[3]: words[1] for words in map(str.split, stub) if words[:1] == ["from"]}

    def get(name):  # type: ignore[no-untyped-def]
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if modules[name] == ".":
            return importlib.import_module(f".{name}", package)
        value = getattr(importlib.import_module(modules[name], package), name)
        setattr(sys.modules[package], name, value)
        return value

    return get, lambda: sorted(modules), sorted(modules)
