"""Comparison of controllers: loops of scenarios on drawn plants; controllers of an antagonistic
joint, tuned alike and judged on plants other than their model.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
