"""Pneumatic artificial muscles: from a bench file to a fitted muscle, from a muscle to a plant with valves and load.

Nouns are frozen models, verbs are functions. Everything inside is SI, pressure is gauge, contraction is
(L0 - L)/L0, pulling is positive. The laws are in `airmuscle.characteristic`, short for
`airmuscle.muscle.characteristic`, the units in `airmuscle.units`, the exceptions in `airmuscle.errors`.

Each name is imported from its package when it is first used (PEP 562), so that `import airmuscle` takes no time.
Type checkers read the same names in `__init__.pyi`.
"""

import importlib as _importlib

__version__ = "0.1.0"

_MODULES = {
    "analysis": "linearise",
    "control": "PID ControlLoop SampledSignal Schedule",
    "core.errors": "AirmuscleError",
    "core.reference": "Reference cite",
    "core.status": "Status",
    "core.system": "System",
    "identify": "Fit fit",
    "library.catalogue": "load load_data",
    "library.files": "list_library",
    "library.write": "save",
    "mechanism": "HangingMass Isometric Mechanism WithLatch",
    "muscle": "LinearDamper LinearSpring Muscle",
    "plant": "Plant",
    "pneumatics": "Circuit FillDischarge Supply Valve",
    "pneumatics.gas": "Ambient Isothermal Polytropic",
    "recording": "Recording read read_csv write_csv",
    "simulation": (
        "DormandPrince8 Problem Rodas4 RungeKutta4 Solution Stepper advance find_equilibrium simulate solve"
    ),
    "simulation.batch": "simulate_batch",
}
"""The module of each public name."""
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}
_PARTS_OF_A_MUSCLE = ("characteristic", "friction", "geometry")
_SUBPACKAGES = (
    *_PARTS_OF_A_MUSCLE, "analysis", "control", "environments", "errors", "export", "identify", "library", "mechanism",
    "muscle", "plant", "pneumatics", "recording", "simulation", "sizing", "study", "units",
)  # fmt: skip

__all__ = sorted([*_MODULE_OF, "units"])  # noqa: PLE0605


def __getattr__(name: str) -> object:
    """Import the module of a public name, or a subpackage, when it is first used."""
    if name in _SUBPACKAGES:
        return _importlib.import_module(f".muscle.{name}" if name in _PARTS_OF_A_MUSCLE else f".{name}", __name__)
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(_importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *_SUBPACKAGES, "__version__"})
