"""Sampled loops: input signals in time, drivers between command and valve, interface of
controllers, sensors.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
