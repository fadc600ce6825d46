"""Pneumatic artificial muscles: from a bench file to a fitted muscle, from a muscle to a plant with
valves and load.

Nouns are frozen models, verbs are functions. Everything inside is SI, pressure is gauge,
contraction is (L0 - L)/L0, pulling is positive. The most used names are here, all others in the
rooms, such as `airmuscle.bench`; `airmuscle.characteristic`, `airmuscle.friction` and
`airmuscle.geometry` are collections of laws, the units are in `airmuscle.units`, the exceptions in
`airmuscle.errors`.

Each name is imported from its package when it is first used, so that `import airmuscle` takes no
time; the names and their packages are those of `__init__.pyi`, which type checkers read, too.
"""

from .core.stubs import attach_stub as _attach_stub

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
