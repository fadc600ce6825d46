"""Identification of friction and creep from hysteresis loops, with tests whether the data justify
them.
"""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
