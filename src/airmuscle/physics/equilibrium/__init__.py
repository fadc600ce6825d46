"""Static equilibria of a plant for given pressures in its muscles, or given masses of air."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
