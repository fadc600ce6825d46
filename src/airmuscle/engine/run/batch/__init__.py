"""Batches: thousands of plants of one structure with different parameters, initial states and
inputs, on all cores.
"""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
