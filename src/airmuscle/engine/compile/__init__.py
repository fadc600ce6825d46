"""From a system over `ops` to machine code: trace, differentiate, print, compile. Nothing here solves anything.

`program.prepared` holds the way in; it is not imported here, because it brings CasADi, which a description of a
system does not need.
"""

from ...core.system import SensitivitySystem, System
from ...core.variables import StateVariable

__all__ = [
    "SensitivitySystem",
    "StateVariable",
    "System",
]
