"""Tuning: gains of a controller for a family of plants, by one optimiser with one budget, in the
batch engine.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
