"""Pneumatic artificial muscles: from a bench file to a fitted muscle, from a muscle to a plant with valves and load.

Nouns are frozen models, verbs are functions. Everything inside is SI, pressure is gauge, contraction is
(L0 - L)/L0, pulling is positive. The most used names are here, all others in the rooms, such as
`airmuscle.bench`; `airmuscle.characteristic`, `airmuscle.friction` and `airmuscle.geometry` are collections of laws,
the units are in `airmuscle.units`, the exceptions in `airmuscle.errors`.

Each name is imported from its package when it is first used, so that `import airmuscle` takes no time; the names and
their packages are those of `__init__.pyi`, which type checkers read, too.
"""

import importlib as _importlib
import sys as _sys

__version__ = "0.1.0"


def _attach_stub(package, file):  # type: ignore[no-untyped-def]
    """`__getattr__`, `__dir__` and `__all__` of a face whose names are imported on use, from the lines
    `from .module import name as name` of its stub.

    Nothing else is imported: until `__main__.main` runs, an interruption cannot be handled.
    """
    with open(f"{file}i", encoding="ascii") as stub:
        modules = {words[3]: words[1] for words in map(str.split, stub) if words[:1] == ["from"]}

    def get(name):  # type: ignore[no-untyped-def]
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if modules[name] == ".":
            return _importlib.import_module(f".{name}", package)
        value = getattr(_importlib.import_module(modules[name], package), name)
        setattr(_sys.modules[package], name, value)
        return value

    return get, lambda: sorted(modules), sorted(modules)


__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
