"""Pneumatic artificial muscles: from a bench file to a fitted muscle, from a muscle to a plant with valves and load.

Nouns are frozen models, verbs are functions. Everything inside is SI, pressure is gauge, contraction is
(L0 - L)/L0, pulling is positive. The laws are in `airmuscle.characteristic`, short for
`airmuscle.muscle.characteristic`, the units in `airmuscle.units`, the exceptions in `airmuscle.errors`.

Each name is imported from its package when it is first used, so that `import airmuscle` takes no time; the names and
their packages are those of `__init__.pyi`, which type checkers read, too.
"""

import lazy_loader as _lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = _lazy_loader.attach_stub(__name__, __file__)
