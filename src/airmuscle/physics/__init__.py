"""Physics: muscles, pneumatics, mechanisms, plants, their equilibria and linearisation."""

from .. import _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
