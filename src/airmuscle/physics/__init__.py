"""Physics: muscles, pneumatics, mechanisms, plants, their equilibria and linearisation."""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
