"""Files: library of parameter sets and scenario files, each table of which is one object."""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
