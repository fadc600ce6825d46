"""Analysis of a plant: stiffness, linearisation, statics of joints."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
