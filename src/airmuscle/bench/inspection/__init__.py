"""Segmentation of recordings: runs, branches, plateaus, transients, outliers and sensor
properties.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
