"""From a system over `ops` to machine code: trace, differentiate, print, compile. Nothing here solves anything."""

from .prepared import Prepared as Prepared
from .prepared import prepared as prepared
from .system import StateVariable as StateVariable
from .system import System as System
