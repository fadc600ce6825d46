"""Bench: readers of measurement files, inspection, identification of muscles and plants,
prediction.
"""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
