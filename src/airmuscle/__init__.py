"""Pneumatic artificial muscles: from a bench file to a fitted muscle, from a muscle to a plant with valves and load.

Nouns are frozen models, verbs are functions. Everything inside is SI, pressure is gauge, contraction is
(L0 - L)/L0, pulling is positive. The laws are in `airmuscle.characteristic`, the units in `airmuscle.units`.

Each name is imported from its package when it is first used (PEP 562), so that `import airmuscle` takes no time.
"""

from __future__ import annotations

import importlib as _importlib

TYPE_CHECKING = False  # known to type checkers; `typing` takes longer to import than the rest of this file
if TYPE_CHECKING:
    import typing as _typing

    from . import (
        analysis as analysis,
    )
    from . import (
        characteristic as characteristic,
    )
    from . import (
        control as control,
    )
    from . import (
        environments as environments,
    )
    from . import (
        export as export,
    )
    from . import (
        friction as friction,
    )
    from . import (
        geometry as geometry,
    )
    from . import (
        identify as identify,
    )
    from . import (
        library as library,
    )
    from . import (
        mechanism as mechanism,
    )
    from . import (
        muscle as muscle,
    )
    from . import (
        pneumatics as pneumatics,
    )
    from . import (
        recording as recording,
    )
    from . import (
        simulation as simulation,
    )
    from . import (
        sizing as sizing,
    )
    from . import (
        units as units,
    )
    from .analysis import linearise
    from .analysis.equilibrium import find_equilibrium
    from .control import PID, ControlLoop, SampledSignal, Schedule
    from .core.errors import AirmuscleError
    from .core.reference import Reference, cite
    from .core.status import Status
    from .core.system import System
    from .identify.result import Fit
    from .identify.static_fit import fit
    from .library.catalogue import load, load_data
    from .library.files import list_library
    from .library.write import save
    from .mechanism import HangingMass, Isometric, Mechanism, WithLatch
    from .muscle import LinearDamper, LinearSpring, Muscle
    from .plant.plant import Plant
    from .pneumatics import Circuit, FillDischarge, Supply, Valve
    from .pneumatics.gas import Ambient, Isothermal, Polytropic
    from .recording import Recording, read, read_csv, write_csv
    from .simulation import DormandPrince8, Problem, Rodas4, RungeKutta4, Solution, Stepper, advance, simulate, solve
    from .simulation.batch import simulate_batch

__version__ = "0.1.0"

_MODULES = {
    "analysis": "linearise",
    "analysis.equilibrium": "find_equilibrium",
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
    "simulation": "DormandPrince8 Problem Rodas4 RungeKutta4 Solution Stepper advance simulate solve",
    "simulation.batch": "simulate_batch",
}
"""The module of each public name."""
_SUBPACKAGES = (
    "analysis", "characteristic", "control", "environments", "export", "friction", "geometry", "identify", "library",
    "mechanism", "muscle", "pneumatics", "recording", "simulation", "sizing", "units",
)  # fmt: skip
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = [
    "PID",
    "AirmuscleError",
    "Ambient",
    "Circuit",
    "ControlLoop",
    "DormandPrince8",
    "FillDischarge",
    "Fit",
    "HangingMass",
    "Isometric",
    "Isothermal",
    "LinearDamper",
    "LinearSpring",
    "Mechanism",
    "Muscle",
    "Plant",
    "Polytropic",
    "Problem",
    "Recording",
    "Reference",
    "Rodas4",
    "RungeKutta4",
    "SampledSignal",
    "Schedule",
    "Solution",
    "Status",
    "Stepper",
    "Supply",
    "System",
    "Valve",
    "WithLatch",
    "advance",
    "characteristic",
    "cite",
    "find_equilibrium",
    "fit",
    "geometry",
    "linearise",
    "list_library",
    "load",
    "load_data",
    "read",
    "read_csv",
    "save",
    "simulate",
    "simulate_batch",
    "solve",
    "units",
    "write_csv",
]


def __getattr__(name: str) -> _typing.Any:
    """Import the module of a public name, or a subpackage, when it is first used."""
    if name in _SUBPACKAGES:
        return _importlib.import_module(f".{name}", __name__)
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(_importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *_SUBPACKAGES, "__version__"})
