"""Linear analysis of control loops: the sampled loop at a working point, its margins and its figures."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
