"""Pneumatic artificial muscles: from a bench file to a fitted muscle, from a muscle to a plant with valves and load.

Nouns are frozen models, verbs are functions. Everything inside is SI, pressure is gauge, contraction is
(L0 - L)/L0, pulling is positive. Laws stand in `airmuscle.characteristic`, units in `airmuscle.units`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from . import characteristic, geometry, units
from .analysis import linearise
from .analysis.equilibrium import find_equilibrium
from .control import PID, ControlLoop, SampledSignal, Schedule
from .core.errors import AirmuscleError
from .core.reference import Reference, cite
from .core.status import Status
from .core.system import System
from .library.catalogue import load, load_data
from .library.files import list_library
from .library.write import save
from .mechanism import HangingMass, Isometric, Mechanism
from .muscle import LinearDamper, LinearSpring, Muscle
from .plant.plant import Plant
from .pneumatics import Circuit, FillDischarge, Supply, Valve
from .pneumatics.gas import Ambient, Isothermal, Polytropic
from .recording import Recording, read, read_csv, write_csv
from .simulation import DormandPrince8, Problem, Rodas4, RungeKutta4, Solution, advance, compiled, simulate, solve
from .simulation.batch import simulate_batch

if TYPE_CHECKING:
    from .identify.result import Fit
    from .identify.static_fit import fit

__version__ = "0.1.0"

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
    "Supply",
    "System",
    "Valve",
    "WithLatch",
    "advance",
    "characteristic",
    "cite",
    "compiled",
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


def __getattr__(name: str) -> Any:
    """Identification, which a simulation does not need, is imported when it is first asked for."""
    if name not in ("Fit", "fit", "identify"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    identify = importlib.import_module(".identify", __name__)
    return identify if name == "identify" else getattr(identify, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
