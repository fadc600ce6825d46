"""Learning environments: plants with a task as Gymnasium environments, single and as vectors of thousands.

Each name is imported when it is first used (PEP 562), because Gymnasium calls `register_environments` at every start.
"""

from __future__ import annotations

import importlib as _importlib

from .registration import register_environments

TYPE_CHECKING = False  # known to type checkers
if TYPE_CHECKING:
    import typing as _typing

    from .arm import ArmReaching
    from .joint import JointTracking
    from .lift import LoadLifting
    from .randomisation import FactorRange, FitUncertainty, Randomisation, ValueRange
    from .task import EnvironmentTask, Observation

_MODULES = {
    "arm": "ArmReaching",
    "joint": "JointTracking",
    "lift": "LoadLifting",
    "randomisation": "FactorRange FitUncertainty Randomisation ValueRange",
    "task": "EnvironmentTask Observation",
}
"""The module of each name."""
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = [
    "ArmReaching",
    "EnvironmentTask",
    "FactorRange",
    "FitUncertainty",
    "JointTracking",
    "LoadLifting",
    "Observation",
    "Randomisation",
    "ValueRange",
    "register_environments",
]


def __getattr__(name: str) -> _typing.Any:
    """Import the module of a name when it is first used."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(_importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
    globals()[name] = value
    return value
