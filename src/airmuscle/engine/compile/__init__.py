"""From a system over `ops` to machine code: trace, differentiate, print, compile. Nothing here
solves anything.

Its names are imported on use, because compiling brings CasADi, which a description of a system does
not need.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
