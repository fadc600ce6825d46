"""Comparison of laws by cross-validation, the recommended law, and its errors on further
specimens.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
